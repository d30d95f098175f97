#pragma once

#include <array>
#include <vector>

#include "stage.h"

namespace chase::perception_stage {

/// Figures over many flights, as in the README of services/perception.
class Score {
 public:
  void Add(const std::vector<Outcome>& flight);

  double recall() const;     ///< of frames with half of the target seen, 2 to 8 m
  double precision() const;  ///< of frames said to show the target
  double rms() const;        ///< of the position while tracking, 2 to 6 m, m
  double p99() const;
  double nees() const;      ///< mean, 3 degrees of freedom
  double coverage() const;  ///< share of truths inside the 95 % ellipsoid
  double hidden_nees() const, hidden_coverage() const;  ///< the same while occluded
  double ms_p50() const, ms_p99() const;
  double said_max() const, found_max() const;  ///< s, after full occlusions
  double said_quantile(double share) const, found_quantile(double share) const;
  /// Frames by the published existence, in tenths.
  struct Bin {
    double frames = 0.0, expected = 0.0, there = 0.0;
  };
  const std::array<Bin, 10>& reliability() const { return reliability_; }
  double calibration_error() const;  ///< expected, of the existence
  int occlusions() const { return static_cast<int>(said_.size()); }
  int returns() const { return static_cast<int>(found_.size()); }
  int wrong_after() const { return wrong_after_; }  ///< returns that took another thing
  int frames() const { return static_cast<int>(ms_.size()); }
  int lost() const { return lost_; }

 private:
  void AddFrame(const Outcome& o);
  void AddOcclusions(const std::vector<Outcome>& flight);

  int visible_ = 0, recalled_ = 0, tracked_ = 0, wrong_ = 0, inside_ = 0, hidden_ = 0,
      hidden_inside_ = 0;
  int wrong_after_ = 0, lost_ = 0;
  double nees_ = 0.0, hidden_nees_ = 0.0;
  std::array<Bin, 10> reliability_;
  std::vector<double> errors_, ms_, said_, found_;
};

}  // namespace chase::perception_stage
