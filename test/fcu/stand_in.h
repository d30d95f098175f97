#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <vector>

#include "services/fcu/mavlink.h"
#include "services/simulator/px4.h"

namespace chase::fcu::testing {

using StandInOptions = simulator::Px4Options;

/// A stand-in for PX4: the simulator's autopilot on a body that is a point with an attitude lag. It
/// has no estimator: it tells the truth. Times are of the host, microseconds.
class StandIn {
 public:
  using Bytes = std::vector<uint8_t>;

  StandIn(const StandInOptions& options, int64_t utime, uint64_t seed)
      : px4_(options, utime, seed), now_(utime), last_tick_(utime) {}

  void Receive(int64_t utime, const Bytes& bytes);
  /// Moves the body on and sends what is due; to be called at 200 Hz or faster.
  void Tick(int64_t utime);
  std::vector<Bytes> TakeOutgoing() { return px4_.TakeOutgoing(); }

  void PilotMode(Mode mode) { px4_.PilotMode(mode); }
  void PilotArms(bool on) { px4_.PilotArms(on); }
  void PilotLifts(double height);  ///< from now on it hovers there, m
  void PilotKills(bool on) { px4_.PilotKills(on); }
  void PilotSticks(double deflection) { px4_.PilotSticks(deflection); }
  void Reboot(int64_t utime);
  StandInOptions& options() { return px4_.options(); }
  void SetCharge(double charge) { body_.charge = charge; }

  bool armed() const { return px4_.armed(); }
  bool failsafe() const { return px4_.failsafe(); }
  Mode mode() const { return px4_.mode(); }
  bool landed() const { return px4_.landed(); }
  const Eigen::Vector3d& p_WB() const { return body_.p_WB; }
  const Eigen::Vector3d& v_WB() const { return body_.v_WB; }
  const Eigen::Quaterniond& R_WB() const { return body_.R_WB; }
  int64_t Clock(int64_t utime) const { return px4_.Clock(utime); }
  std::optional<int64_t> HostTime(uint64_t stamp) const { return px4_.HostTime(stamp); }
  const simulator::Px4::Seen& seen() const { return px4_.seen(); }

 private:
  void Move(double dt);
  void Turn(const Eigen::Quaterniond& wanted, double dt);

  simulator::Px4 px4_;
  simulator::Px4Body body_;
  int64_t now_, last_tick_;
};

}  // namespace chase::fcu::testing
