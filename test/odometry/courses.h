#pragma once

#include <string>
#include <vector>

#include "common/world/scenario.h"
#include "services/control/tracking_law.h"

namespace chase::odometry::trial {

/// What a pilot is asked to fly: a function of mission time. Until kTakeoff the body stands.
class Course {
 public:
  static constexpr double kTakeoff = -6.0;  ///< mission time, s

  /// `name` is one of Names(). Throws std::runtime_error otherwise.
  Course(const std::string& name, const world::Scenario& scenario);

  static std::vector<std::string> Names();

  bool Flies() const { return name_ != "rest"; }
  control::Reference At(double t) const;

 private:
  Eigen::Vector3d Position(double t) const;
  Eigen::Vector3d AfterTarget(double t) const;
  Eigen::Vector3d Aggressive(double t) const;
  double Yaw(double t) const;

  std::string name_;
  Eigen::Vector3d start_;
  double takeoff_height_, yaw_, delay_;
  bool indoors_;
  world::PathMotion target_;
};

}  // namespace chase::odometry::trial
