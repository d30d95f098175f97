#include "services/mapping/mapping_config.h"

#include <cmath>
#include <sstream>

#include "services/mapping/voxel_grid.h"

namespace chase::mapping {

namespace {

/// "name is value; it must be limit", or an empty string when `holds`.
template <class T>
std::string Require(bool holds, const char* name, T value, const char* limit) {
  if (holds) return "";
  std::ostringstream text;
  text << name << " is " << value << "; it must be " << limit;
  return text.str();
}

std::string First(std::initializer_list<std::string> problems) {
  for (const auto& problem : problems)
    if (!problem.empty()) return problem;
  return "";
}

std::string Within(const char* name, double value, double low, double high) {
  if (value >= low && value <= high) return "";
  std::ostringstream text;
  text << name << " is " << value << "; it must be within " << low << " and " << high;
  return text.str();
}

}  // namespace

std::string GridConfig::Problem() const {
  const double reach = 0.5 * VoxelGrid::kSide * resolution - 2.0;
  return First({Within("resolution", resolution, 0.05, 1.0),
                Require(range > 1.0 && range <= reach, "range", range,
                        "above 1 and at most 128 cells less 2 m"),
                Within("min_range", min_range, 0.0, 5.0), Within("hit", hit, 1, 60),
                Within("miss", miss, -60, -1), Within("limit", limit, 2, 100),
                Within("occupied", occupied, 1, limit),
                Within("ever_free_sweeps", ever_free_sweeps, 1, 200)});
}

std::string GroundConfig::Problem() const {
  return First({Within("margin", margin, 0.0, 2.0), Within("step", step, 0.05, 2.0)});
}

std::string StaticConfig::Problem() const {
  return First({Within("radius", radius, 1.0, 50.0), Within("band_low", band_low, -5.0, 50.0),
                Require(band_high > band_low, "band_high", band_high, "above band_low"),
                Within("unseen", unseen, 0.0, radius),
                Require(semi_height >= 0.75 * (band_high - band_low), "semi_height", semi_height,
                        "at least 0.75 (band_high - band_low)"),
                Within("max_length", max_length, 0.4, 20.0),
                Within("compact_radius", compact_radius, 0.0, 5.0),
                Within("waste", waste, 0.01, 5.0),
                Within("tolerance_permille", tolerance_permille, 1, 100)});
}

std::string MoverConfig::Problem() const {
  return First({Within("min_points", min_points, 1, 10000),
                Within("cluster_cell", cluster_cell, 0.05, 5.0),
                Within("max_size", max_size, 0.1, 50.0), Within("gate", gate, 0.5, 20.0),
                Within("acceleration", acceleration, 0.01, 50.0),
                Within("measurement", measurement, 0.001, 5.0),
                Within("confirm_sweeps", confirm_sweeps, 1, 100),
                Within("confirm_distance", confirm_distance, 0.0, 10.0),
                Within("confirm_speed", confirm_speed, 0.0, 10.0),
                Within("change_rate", change_rate, 0.0, 10.0),
                Within("change_speed", change_speed, 0.0, 10.0),
                Within("lifetime", lifetime, 0.1, 60.0), Within("sweep_time", sweep_time, 0.0, 1.0),
                Within("settle", settle, 0.1, 60.0), Within("horizon", horizon, 0.1, 60.0)});
}

std::string TargetConfig::Problem() const {
  return First({Within("margin", margin, 0.0, 5.0), Within("core", core, 0.0, margin),
                Within("hold", hold, 0.0, 60.0)});
}

std::string TreeConfig::Problem() const {
  return First({Within("updates_per_sweep", updates_per_sweep, 1, 1000000),
                Within("keep_radius", keep_radius, 5.0, 1000.0)});
}

std::string MappingConfig::Problem() const {
  return First({grid.Problem(), ground.Problem(), statics.Problem(), movers.Problem(),
                target.Problem(), tree.Problem(), Within("max_obstacles", max_obstacles, 1, 1000),
                Within("map_period", map_period, 0.05, 3600.0)});
}

}  // namespace chase::mapping
