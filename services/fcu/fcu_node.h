#pragma once

#include <memory>
#include <optional>

#include "chase/attitude_setpoint_t.hpp"
#include "chase/command_t.hpp"
#include "chase/pose_t.hpp"
#include "common/bus/bus.h"
#include "common/bus/node.h"
#include "services/fcu/bridge.h"
#include "services/fcu/transport.h"

namespace chase::fcu {

/// ATTITUDE_SETPOINT and POSE to the autopilot, its IMU as IMU; its state is the status message. Of
/// COMMAND it obeys the forced kill alone: nobody else is between an operator and the motors.
class FcuNode : public bus::Node {
 public:
  /// Throws std::runtime_error when the link or the key cannot be had.
  FcuNode(bus::Bus& bus, const FcuConfig& config);

  int64_t TickPeriod() const override { return 2'500; }  // us: half of the IMU's period
  void Tick(int64_t utime) override;
  bus::NodeReport Report() const override;

 private:
  void OnPose(const pose_t& message);
  void OnSetpoint(const attitude_setpoint_t& message);
  void OnCommand(const command_t& message);
  void TakeIn(int64_t now);
  void SendOut();
  void Notice();
  std::string Silence() const;

  bus::Bus& bus_;
  FcuConfig config_;
  Bridge bridge_;
  std::unique_ptr<Transport> transport_;
  std::optional<int64_t> first_tick_;
  int64_t now_ = 0;
  Handshake::State noticed_ = Handshake::State::kNoAutopilot;
};

}  // namespace chase::fcu
