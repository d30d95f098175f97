#pragma once

#include <algorithm>
#include <cmath>
#include <string>

namespace chase::simulator {

struct BatteryConfig {
  double endurance = 1200.0;  ///< s
  double charge = 1.0;

  template <class V>
  void Visit(V& v) {
    v("endurance", endurance, "a full charge hovers for so long, s");
    v("charge", charge, "share of it at power-on, 0 to 1");
  }
  std::string Problem() const {
    if (!(endurance > 0.0)) return "endurance is not above 0 s";
    return charge >= 0.0 && charge <= 1.0 ? "" : "charge is not within 0 to 1";
  }
};

/// Charge that the motors draw. By momentum theory the induced power of a rotor grows with its
/// thrust to the power of 3/2 (Leishman, Principles of Helicopter Aerodynamics, section 2.3).
class Battery {
 public:
  explicit Battery(const BatteryConfig& config)
      : endurance_(config.endurance), charge_(config.charge) {}

  /// For `dt` s at `load`, the thrust over that of hovering.
  void Draw(double load, double dt) {
    const double positive = std::max(0.0, load);
    charge_ = std::max(0.0, charge_ - dt / endurance_ * positive * std::sqrt(positive));
  }
  double charge() const { return charge_; }  ///< share, 0 to 1

 private:
  double endurance_, charge_;
};

}  // namespace chase::simulator
