#pragma once

#include <optional>

#include "logs/src/flight_record.h"

namespace chase::logs {

/// p_WB and p_WT of the truth at mission time t and the body's yaw [rad], linear between samples;
/// nothing outside them.
struct TruePositions {
  Eigen::Vector3d body, target;
  double yaw;
};
std::optional<TruePositions> TruthAt(const std::vector<TruthSample>& truth, double t);

/// From the true frame W to the one that `pose` was estimated in, by where the body truly was then.
Eigen::Isometry3d FrameAt(const PoseSample& pose, const TruePositions& truth);

/// RMSE of POSE against the truth of the same time over the mission, m: as it is (both are in W;
/// truth is brought to a later epoch's frame by that one's first POSE, here and below) and after
/// the best rigid alignment.
struct TrajectoryError {
  std::optional<double> raw, aligned;
};
TrajectoryError OdometryError(const FlightRecord& record);

/// RMSE of the tracked target's mean over the mission, m.
std::optional<double> TargetRmse(const FlightRecord& record);

/// Mean distance between the predicted and the true target `horizon` s after the predictions'
/// start, over the mission's predictions that reach so far, m.
std::optional<double> PredictionError(const FlightRecord& record, double horizon);

/// The same of a straight line in place of each of them: from the newest TARGET up to the
/// prediction's start on with that one's velocity; where both are of one epoch.
std::optional<double> ConstantVelocityError(const FlightRecord& record, double horizon);

}  // namespace chase::logs
