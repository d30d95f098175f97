#include "services/odometry/odometry_config.h"

#include <cmath>
#include <sstream>

namespace chase::odometry {

namespace {

std::string OutOfRange(const char* name, double value, const char* limit) {
  std::ostringstream text;
  text << name << " is " << value << ": must be " << limit;
  return text.str();
}

}  // namespace

std::string OdometryConfig::Problem() const {
  const auto positive = [](const char* name, double value) {
    return value > 0.0 && std::isfinite(value) ? "" : OutOfRange(name, value, "above 0");
  };
  const struct {
    const char* name;
    double value;
  } above_zero[] = {{"alignment.duration", alignment.duration},
                    {"features.min_range", features.min_range},
                    {"features.window", features.window},
                    {"features.plane_deviation", features.plane_deviation},
                    {"map.cell_size", map.cell_size},
                    {"map.keep_range", map.keep_range},
                    {"map.plane_thickness", map.plane_thickness},
                    {"match.gate", match.gate},
                    {"match.kernel", match.kernel},
                    {"match.range_noise", match.range_noise},
                    {"match.min_support", match.min_support},
                    {"filter.gyro_noise", filter.gyro_noise},
                    {"filter.accel_noise", filter.accel_noise},
                    {"spikes.full_accel", spikes.full_accel},
                    {"spikes.full_rate", spikes.full_rate},
                    {"spikes.accel_jump", spikes.accel_jump},
                    {"spikes.rate_jump", spikes.rate_jump},
                    {"filter.gravity", filter.gravity},
                    {"filter.match_position_floor", filter.match_position_floor},
                    {"filter.match_rotation_floor", filter.match_rotation_floor},
                    {"blend.time_constant", blend.time_constant},
                    {"blend.position_rate", blend.position_rate},
                    {"blend.rotation_rate", blend.rotation_rate},
                    {"health.degraded_after", health.degraded_after},
                    {"health.lost_sigma", health.lost_sigma}};
  for (const auto& field : above_zero)
    if (const std::string problem = positive(field.name, field.value); !problem.empty())
      return problem;
  if (!initial_position.allFinite()) return "initial_position is not finite";
  if (!std::isfinite(initial_yaw_deg)) return "initial_yaw_deg is not finite";
  if (match_points < 200) return OutOfRange("match_points", match_points, "at least 200");
  if (map_stride < 1) return OutOfRange("map_stride", map_stride, "at least 1");
  if (features.max_range <= features.min_range)
    return OutOfRange("features.max_range", features.max_range, "above features.min_range");
  if (map.levels < 1 || map.levels > 6) return OutOfRange("map.levels", map.levels, "1 to 6");
  if (map.max_points < 5) return OutOfRange("map.max_points", map.max_points, "at least 5");
  if (map.max_cells < 1000) return OutOfRange("map.max_cells", map.max_cells, "at least 1000");
  if (match.max_iterations < 1)
    return OutOfRange("match.max_iterations", match.max_iterations, "at least 1");
  return "";
}

}  // namespace chase::odometry
