#pragma once

#include <cstdint>
#include <optional>

#include "chase/plan_t.hpp"
#include "chase/pose_t.hpp"
#include "common/bus/bus.h"
#include "common/bus/node.h"
#include "services/control/controller.h"

namespace chase::control {

/// PLAN and POSE in, ATTITUDE_SETPOINT out; every POSE triggers.
class ControlNode : public bus::Node {
 public:
  ControlNode(bus::Bus& bus, const ControlConfig& config);
  bus::NodeReport Report() const override;

 private:
  void OnPlan(const plan_t& message);
  void OnPose(const pose_t& message);
  void Send(int64_t utime, const Setpoint& setpoint);
  int64_t Origin(int64_t utime);

  bus::Bus& bus_;
  Controller controller_;
  std::optional<int64_t> origin_;  // utime that the core's seconds count from
};

}  // namespace chase::control
