#include "logs/src/figure_table.h"

#include <fmt/format.h>

#include <cmath>

namespace chase::logs {

std::string ShownFigure::Text(double value) const {
  return fmt::format("{:.{}f}{}{}", scale * value, digits, *unit ? " " : "", unit);
}

double ShownFigure::HalfDigit() const { return 0.5 * std::pow(10.0, -digits) / scale; }

const std::vector<ShownFigure>& FigureTable() {
  static const std::vector<ShownFigure> figures = {
      {"safe_ratio", "Safe", "%", 100, 2, Better::kHigher},
      {"visible_ratio", "Target in line of sight", "%", 100, 2, Better::kHigher},
      {"in_image_ratio", "Target in the image", "%", 100, 2, Better::kHigher},
      {"min_clearance_m", "Smallest clearance", "m", 1, 2, Better::kHigher},
      {"certified_clearance_m", "Smallest certified clearance", "m", 1, 2, Better::kHigher},
      {"certificate_kept_ratio", "Certificate kept", "%", 100, 2, Better::kHigher},
      {"tube_exceeded_ratio", "Outside the tube", "%", 100, 2, Better::kLower},
      {"certified_ratio", "Plans that are certified", "%", 100, 1, Better::kHigher},
      {"distance_ratio", "Distance over the desired one", "", 1, 3, Better::kNearOne},
      {"distance_error", "Its mean absolute error", "", 1, 3, Better::kLower},
      {"travel_ratio", "Path length, chaser over target", "", 1, 2, {}},
      {"path_m", "Path length", "m", 1, 1, {}},
      {"speed_max_mps", "Highest speed", "m/s", 1, 2, {}},
      {"acceleration_cost", "Acceleration cost", "m²/s⁴", 1, 2, Better::kLower},
      {"jerk_cost", "Jerk cost", "m²/s⁶", 1, 1, Better::kLower},
      {"yaw_rate_rms", "Yaw rate, RMS", "rad/s", 1, 2, Better::kLower},
      {"plan_ms.p50", "Planning, median", "ms", 1, 1, Better::kLower},
      {"plan_ms.p99", "Planning, 99th percentile", "ms", 1, 1, Better::kLower},
      {"predict_ms.p50", "Prediction, median", "ms", 1, 1, Better::kLower},
      {"predict_ms.p99", "Prediction, 99th percentile", "ms", 1, 1, Better::kLower},
      {"sweep_to_setpoint_ms.p50", "Sweep to setpoint, median", "ms", 1, 1, Better::kLower},
      {"sweep_to_setpoint_ms.p99", "Sweep to setpoint, 99th percentile", "ms", 1, 1,
       Better::kLower},
      {"replans", "Plans", "", 1, 0, {}},
      {"fallbacks", "Fallbacks", "", 1, 0, Better::kLower},
      {"uncertified_brakes", "Last resorts without certificate", "", 1, 0, Better::kLower},
      {"accelerating_brakes", "Braking that speeds up", "", 1, 0, Better::kLower},
      {"odometry_ate_m", "Odometry, RMSE", "m", 1, 3, Better::kLower},
      {"odometry_ate_aligned_m", "Odometry, RMSE after alignment", "m", 1, 3, {}},
      {"pose_sigma_max_m", "Pose, largest standard deviation", "m", 1, 3, Better::kLower},
      {"frame_changes", "Changes of the frame W", "", 1, 0, {}},
      {"target_rmse_m", "Target, RMSE", "m", 1, 3, Better::kLower},
      {"target_known_ratio", "Target known", "%", 100, 1, Better::kHigher},
      {"prediction_error_m", "Prediction 1 s ahead, mean error", "m", 1, 3, Better::kLower},
      {"tracking_error_m.p50", "Distance from the plan, median", "m", 1, 3, Better::kLower},
      {"tracking_error_m.p99", "Distance from the plan, 99th percentile", "m", 1, 3,
       Better::kLower},
      {"tracking_error_p99_m", "Distance from the plan, 99th percentile", "m", 1, 3,
       Better::kLower},
      {"latency_ms.POSE.p99", "Age of POSE, 99th percentile", "ms", 1, 1, Better::kLower},
      {"latency_ms.TARGET.p99", "Age of TARGET, 99th percentile", "ms", 1, 1, Better::kLower},
      {"latency_ms.OBSTACLES.p99", "Age of OBSTACLES, 99th percentile", "ms", 1, 1, Better::kLower},
      {"stages_ms.planning plan.p99", "Planning, 99th percentile", "ms", 1, 1, Better::kLower},
      {"reaction_s", "Reaction after the age limit", "s", 1, 2, Better::kLower},
      {"recovery_s", "Recovered after the fault's end", "s", 1, 2, Better::kLower},
      {"nonfinite_setpoints", "Setpoints that are no numbers", "", 1, 0, Better::kLower},
      {"touchdown_speed_mps", "Speed at touchdown", "m/s", 1, 2, Better::kLower},
      {"motors_off_s", "Motors off after", "s", 1, 1, Better::kLower},
      {"real_time_factor", "Real-time factor", "", 1, 2, Better::kHigher},
      {"flown_s", "Flown", "s", 1, 1, Better::kHigher},
  };
  return figures;
}

}  // namespace chase::logs
