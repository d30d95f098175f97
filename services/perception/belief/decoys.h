#pragma once

#include <Eigen/Core>
#include <vector>

#include "services/perception/perception_config.h"

namespace chase::perception {

/// A thing that looks like the target and is not.
struct Decoy {
  Eigen::Vector3d p_W, start;  ///< now and when first seen, frame W, m
  double t;                    ///< last seen, s
  int hits;

  bool known() const;
  /// True when it has moved from where it was first seen; things within `radius` m may be one here.
  bool Driven(double radius) const;
};

/// Where look-alikes stand that were seen while the target was in view.
class Decoys {
 public:
  explicit Decoys(const StateConfig& config) : config_(config) {}

  /// The known one at this place, or null.
  const Decoy* At(const Eigen::Vector3d& p_W) const;
  /// Adds a sighting, and gives what is known there now; null when the memory is full.
  Decoy* Note(const Eigen::Vector3d& p_W, double t, int hits = 1);
  /// Leaves out what is too old, or where the target stands itself.
  void Forget(double t, const Eigen::Vector3d& p_WT);
  void Clear() { all_.clear(); }

 private:
  StateConfig config_;
  std::vector<Decoy> all_;
};

}  // namespace chase::perception
