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
  double edge_deviation = 0.08;          ///< smallest bend of an edge feature, m
  int edges_per_sector = 4;              ///< a ring has six sectors

  template <class V>
  void Visit(V& v) {
    v("min_range", min_range, "nearer returns are the drone itself, m");
    v("max_range", max_range, "farther returns are left out, m");
    v("window", window, "half length of the neighbourhood along a ring, m");
    v("plane_deviation", plane_deviation, "largest bend of a plane feature, m");
    v("plane_deviation_ratio", plane_deviation_ratio, "added to it per metre of range");
    v("edge_deviation", edge_deviation, "smallest bend of an edge feature, m");
    v("edges_per_sector", edges_per_sector, "most edge features in a sixth of a ring");
  }
};

/// Indices into a sweep's points.
struct FeatureSet {
  std::vector<int> planes;
  std::vector<int> edges;
};

/// Removes what no one can use: not finite, too near, too far, a time outside [0, 0.2] s.
void RemoveUnusable(const FeatureConfig& config, std::vector<SweepPoint>* points);

/// Edge and plane features by the curvature along each ring, after Zhang & Singh 2014 (LOAM), eq.
/// (1). The bend is measured perpendicular to the ring, in metres, over a window of fixed length,
/// so that the thresholds hold indoors and outdoors. Jumps in range give no feature: they move with
/// the view.
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
