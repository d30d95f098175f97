#include "test/odometry/courses.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace chase::odometry::trial {

namespace {

using Eigen::Vector3d;

double SmoothStep(double x) {
  x = std::clamp(x, 0.0, 1.0);
  return x * x * x * (10.0 + x * (-15.0 + 6.0 * x));
}

}  // namespace

std::vector<std::string> Course::Names() { return {"follow", "aggressive", "hover", "rest"}; }

Course::Course(const std::string& name, const world::Scenario& scenario)
    : name_(name),
      start_(scenario.chaser.start),
      takeoff_height_(scenario.chaser.takeoff_height),
      yaw_(scenario.chaser.yaw_deg * M_PI / 180.0),
      delay_(scenario.chaser.desired_distance / scenario.target.speed),
      indoors_(!scenario.world.walls.empty()),
      target_(world::TargetMotion(scenario)) {
  const auto names = Names();
  if (std::find(names.begin(), names.end(), name) == names.end())
    throw std::runtime_error("--course " + name + ": use follow, aggressive, hover or rest");
}

/// The target's own way, the desired distance behind it.
Vector3d Course::AfterTarget(double t) const {
  const Eigen::Vector2d p = target_.Position(t - delay_), first = target_.Position(0.0);
  const Eigen::Vector2d offset = (1.0 - SmoothStep(t / 4.0)) * (start_.head<2>() - first);
  return {p.x() + offset.x(), p.y() + offset.y(), start_.z() + takeoff_height_};
}

/// Accelerations of a tilt of 35 degrees, climbs of 3 m/s: on the spot indoors, along the target's
/// way outdoors.
Vector3d Course::Aggressive(double t) const {
  const double ramp = SmoothStep(t / 3.0), s = std::max(0.0, t);
  if (indoors_) {
    const double over = 1.0 - SmoothStep((t - kTakeoff) / -kTakeoff);
    const Vector3d center = Vector3d(1.9, 0.0, 1.9) + over * (start_ - Vector3d(1.9, 0.0, 1.9));
    return center + ramp * Vector3d(0.9 * std::sin(2.5 * s), 2.2 * std::sin(1.75 * s),
                                    1.15 * std::sin(2.6 * s));
  }
  Vector3d p = AfterTarget(t);
  const Vector3d way = AfterTarget(t + 0.2) - AfterTarget(t - 0.2);
  const Vector3d side = Vector3d(-way.y(), way.x(), 0.0) / std::max(0.05, way.norm());
  p += ramp * (0.95 * std::sin(2.65 * s) * side);
  p.z() += ramp * (0.8 + 1.1 * std::sin(2.75 * s));
  return p;
}

Vector3d Course::Position(double t) const {
  const Vector3d up(0.0, 0.0, takeoff_height_);
  const double risen = SmoothStep((t - kTakeoff) / 4.0);
  if (name_ == "hover") return start_ + risen * up;
  const Vector3d p = name_ == "follow" ? AfterTarget(t) : Aggressive(t);
  return start_ + risen * (p - start_);
}

double Course::Yaw(double t) const {
  if (name_ == "hover") return yaw_;
  if (name_ == "aggressive" && indoors_)
    return yaw_ + 0.9 * SmoothStep(t / 3.0) * std::sin(0.5 * t);
  double at = std::min(t, target_.Duration() + delay_ - 1.0);
  const Vector3d way = AfterTarget(at + 0.8) - AfterTarget(at - 0.4);
  return way.norm() > 0.05 ? std::atan2(way.y(), way.x()) : yaw_;
}

control::Reference Course::At(double t) const {
  constexpr double h = 0.02;
  control::Reference r;
  r.state.p = Position(t);
  r.state.v = (Position(t + h) - Position(t - h)) / (2.0 * h);
  r.state.a = (Position(t + h) - 2.0 * Position(t) + Position(t - h)) / (h * h);
  r.state.j =
      (Position(t + 2 * h) - 2 * Position(t + h) + 2 * Position(t - h) - Position(t - 2 * h)) /
      (2.0 * h * h * h);
  r.yaw = Yaw(t);
  r.yaw_rate = std::remainder(Yaw(t + h) - Yaw(t - h), 2.0 * M_PI) / (2.0 * h);
  return r;
}

}  // namespace chase::odometry::trial
