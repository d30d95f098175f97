#pragma once

#include <algorithm>
#include <cmath>
#include <string>

namespace chase::simulator {

struct BatteryConfig {
  double endurance = 1200.0;  ///< s
  double charge = 1.0;
  bool sags = false;

  template <class V>
  void Visit(V& v) {
    v("endurance", endurance, "a full charge hovers for so long, s");
    v("charge", charge, "share of it at power-on, 0 to 1");
    v("sags", sags, "the motors' thrust goes with the square of its voltage");
  }
  std::string Problem() const {
    if (!(endurance > 0.0)) return "endurance is not above 0 s";
    return charge >= 0.0 && charge <= 1.0 ? "" : "charge is not within 0 to 1";
  }
};

// Four cells: at rest, and what their resistance takes at the hover's current (20 A, 20 mOhm), V.
inline constexpr double kEmptyVolts = 14.0, kFullVolts = 16.8, kHoverDrop = 0.4;

constexpr double RestVolts(double charge) {
  return kEmptyVolts + (kFullVolts - kEmptyVolts) * charge;
}

/// Charge that the motors draw. By momentum theory the induced power of a rotor grows with its
/// thrust to the power of 3/2 (Leishman, Principles of Helicopter Aerodynamics, section 2.3).
class Battery {
 public:
  explicit Battery(const BatteryConfig& config)
      : endurance_(config.endurance), charge_(config.charge), sags_(config.sags) {}

  /// For `dt` s at `load`, the thrust over that of hovering.
  void Draw(double load, double dt) {
    const double positive = std::max(0.0, load);
    power_ = positive * std::sqrt(positive);
    charge_ = std::max(0.0, charge_ - dt / endurance_ * power_);
  }
  /// Of the thrust that the motors give on a full one at the hover. A rotor's speed goes with the
  /// voltage, its thrust with the square of its speed.
  double ThrustShare() const {
    if (!sags_) return 1.0;
    const double share = (RestVolts(charge_) - kHoverDrop * power_) / (kFullVolts - kHoverDrop);
    return share * share;
  }
  double charge() const { return charge_; }  ///< share, 0 to 1

 private:
  double endurance_, charge_;
  bool sags_;
  double power_ = 0.0;  // over that of hovering
};

}  // namespace chase::simulator
