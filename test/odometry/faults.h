#pragma once

#include <cstdint>
#include <deque>
#include <string>
#include <vector>

#include "chase/imu_t.hpp"
#include "chase/lidar_scan_t.hpp"
#include "chase/truth_t.hpp"
#include "common/world/random.h"

namespace chase::odometry::trial {

/// Something that goes wrong with the sensors at a time of the flight.
class Fault {
 public:
  /// `name` is one of Names() or "none"; it strikes at `at` microseconds. Throws
  /// std::runtime_error for another name.
  Fault(const std::string& name, int64_t at);

  static std::vector<std::string> Names();

  /// Ends this long after it struck, microseconds.
  int64_t Duration() const;

  void See(const truth_t& truth) { truth_.push_back(truth); }
  /// Changes what comes at `now`; false: it does not come at all.
  bool Pass(int64_t now, imu_t* imu) const;
  bool Pass(int64_t now, lidar_scan_t* scan);

 private:
  bool Active(int64_t utime) const { return utime >= at_ && utime < at_ + Duration(); }
  void KeepCorridor(lidar_scan_t* scan) const;
  void DropSome(lidar_scan_t* scan);

  std::string name_;
  int64_t at_;
  std::deque<truth_t> truth_;
  world::Random random_{1};
};

}  // namespace chase::odometry::trial
