#pragma once

#include <string>

#include "common/world/rig.h"
#include "services/odometry/alignment.h"
#include "services/odometry/correction_blend.h"
#include "services/odometry/features.h"
#include "services/odometry/health_monitor.h"
#include "services/odometry/map_drift.h"
#include "services/odometry/scan_matcher.h"
#include "services/odometry/spike_filter.h"
#include "services/odometry/surface_map.h"

namespace chase::odometry {

struct OdometryConfig {
  world::Rig rig;
  Eigen::Vector3d initial_position = Eigen::Vector3d::Zero();  ///< p_WB at power-on, m
  double initial_yaw_deg = 0.0;                                ///< heading at power-on
  int match_points = 3000;  ///< plane features matched per sweep, about
  int map_stride = 2;       ///< every how many-th plane feature the map learns
  SpikeConfig spikes;
  AlignmentConfig alignment;
  FeatureConfig features;
  MapConfig map;
  DriftConfig drift;
  MatchConfig match;
  FilterConfig filter;
  BlendConfig blend;
  HealthConfig health;

  template <class V>
  void Visit(V& v) {
    v("rig", rig, "where the lidar sits");
    v("initial_position", initial_position, "p_WB at power-on, m");
    v("initial_yaw_deg", initial_yaw_deg, "heading at power-on");
    v("match_points", match_points, "plane features matched per sweep, about");
    v("map_stride", map_stride, "every how many-th plane feature the map learns");
    v("spikes", spikes, "inertial samples that are left out");
    v("alignment", alignment, "start-up at rest");
    v("features", features, "plane features and posts");
    v("map", map, "local map");
    v("drift", drift, "how far the local map goes astray");
    v("match", match, "scan to map");
    v("filter", filter, "error-state filter");
    v("blend", blend, "how corrections are spread on POSE");
    v("health", health, "limits of the health field");
  }

  std::string Problem() const;
};

}  // namespace chase::odometry
