#pragma once

#include <vector>

#include "services/odometry/sweep.h"

namespace chase::odometry {

struct FeatureConfig {
  double min_range = 0.4;                ///< m
  double max_range = 100.0;              ///< m
  double window = 0.16;                  ///< half length of the neighbourhood along a ring, m
  double plane_deviation = 0.04;         ///< largest bend of a plane feature, m
  double plane_deviation_ratio = 0.003;  ///< added per metre of range
  double post_width = 1.0;               ///< of the widest post, m

  template <class V>
  void Visit(V& v) {
    v("min_range", min_range, "nearer returns are the drone itself, m");
    v("max_range", max_range, "farther returns are left out, m");
    v("window", window, "half length of the neighbourhood along a ring, m");
    v("plane_deviation", plane_deviation, "largest bend of a plane feature, m");
    v("plane_deviation_ratio", plane_deviation_ratio, "added to it per metre of range");
    v("post_width", post_width, "of the widest post, m");
  }
};

/// Where a ring crosses something upright that stands before what is behind it: the axis of a trunk
/// or a lamp post, the end of a wall.
struct Post {
  int point = 0;                                      ///< of the sweep, on it
  Eigen::Vector3f to_axis = Eigen::Vector3f::Zero();  ///< from that point, frame L, m
};

struct FeatureSet {
  std::vector<int> planes;  ///< indices into a sweep's points
  std::vector<Post> posts;
};

/// Removes what no one can use: not finite, too near, too far, a time outside [0, 0.2] s.
void RemoveUnusable(const FeatureConfig& config, std::vector<SweepPoint>* points);

/// Plane features by the curvature along each ring, after Zhang & Singh 2014 (LOAM), eq. (1): the
/// bend is measured perpendicular to the ring, in metres, over a window of fixed length, so that
/// the thresholds hold indoors and outdoors. Outlines move with the view and give no feature, but
/// for a post: the axis between its two outlines stays.
FeatureSet ExtractFeatures(const FeatureConfig& config, const std::vector<SweepPoint>& points);

/// Takes features so that each stands for about the same area of what the sensor sees. The choice
/// goes by the density of the beams at the point's range alone: whoever takes one point of every
/// cube of space prefers those that noise has pushed into a cube of their own, in the sense of the
/// revolution, and turns the pose by a milliradian.
class Thinning {
 public:
  /// About `wanted` of `indices` in their order; the area is adapted from call to call.
  std::vector<int> Evenly(const std::vector<SweepPoint>& points, const std::vector<int>& indices,
                          int wanted);

 private:
  double size_ = 0.1;  // edge of the area, m
};

}  // namespace chase::odometry
