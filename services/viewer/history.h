#pragma once

#include <deque>
#include <string>

#include "services/viewer/scene.h"

namespace chase::viewer {

/// One instant of a flight, as strips, time line and trail show it. Figures that are unknown, or
/// too old to be shown, are NaN, such codes -1.
struct Sample {
  double t = 0.0;                              ///< s
  Eigen::Vector3d p_WB, p_WT;                  ///< m
  double distance, clearance, speed, plan_ms;  ///< m, m, m/s, ms
  int verdict = -1, target_state = -1, health = -1, flight = -1, processes = -1;
  std::string faults;  ///< names of those that last
};

Sample SampleOf(const Scene& scene, double t);

/// The samples of the last `length` seconds, at most `kMost` of them: when there are more every
/// second one goes.
class History {
 public:
  static constexpr size_t kMost = 2400;  // wider than any screen

  explicit History(double length) : length_(length) {}
  void Add(const Sample& sample);
  /// After a change of the frame W: no position stays.
  void ForgetPositions();
  const std::deque<Sample>& samples() const { return samples_; }

 private:
  double length_;
  std::deque<Sample> samples_;
};

}  // namespace chase::viewer
