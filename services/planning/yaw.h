#pragma once

#include <optional>
#include <vector>

#include "common/world/trajectory.h"
#include "common/world/yaw.h"

namespace chase::planning {

using YawStart = world::Yaw;  ///< of a plan

/// Polynomial in tau of degree 6 that follows the bearing of `target` from `plan`, at most
/// `max_rate` rad/s where it has to catch up, and continues `start` where given: least squares over
/// samples. Power basis, unwrapped, rad.
std::vector<double> FitYaw(const world::Trajectory& plan, const world::Trajectory& target,
                           const std::optional<YawStart>& start, double max_rate);

/// A constant rate of turn over `duration` s.
std::vector<double> TurningYaw(const YawStart& start, double duration);

double EvaluateYaw(const std::vector<double>& yaw, double tau);
YawStart YawAt(const std::vector<double>& yaw, double tau, double duration);

}  // namespace chase::planning
