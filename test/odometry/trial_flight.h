#pragma once

#include <string>

namespace chase::odometry::trial {

struct FlightOptions {
  std::string scenario, course = "follow";
  int64_t seed = 1;
  double noise = 1.0;   ///< factor on the noise, biases and dropouts of the sensors
  double until = -1.0;  ///< mission time, s; negative: the scenario's end
  std::string fault = "none";
  double fault_at = 10.0;  ///< mission time, s
};

/// Flies a course with the simulator and a pilot who knows the truth; writes IMU, LIDAR_SCAN, TRUTH
/// and SCENARIO to an LCM log. The sensors alone: odometry is replayed on the log.
void Record(const FlightOptions& options, const std::string& log);

/// The same with odometry in the same process and nothing recorded; prints the memory that the
/// process and the map hold, every minute.
void Endure(const FlightOptions& options, double minutes);

}  // namespace chase::odometry::trial
