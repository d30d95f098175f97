#pragma once

namespace chase::baselines {

/// Parameters of the hierarchical planner; values in brackets are those of its authors' code.
struct HierarchicalParameters {
  int layers = 5;                   ///< [3 for 4 s, 5 for 7 s]
  double cell = 0.3;                ///< of the visibility field, m [0.5, 0.4]
  double field_cell = 0.15;         ///< of the distance field, m
  double field_cut = 2.0;           ///< its largest value, m
  double min_distance = 1.5;        ///< to the target, m [1, 0.5]
  double max_distance = 4.5;        ///< [3]
  double desired_distance = 3.0;    ///< [1.5]
  double max_elevation_deg = 25.0;  ///< [45, 36]
  double box_height = 1.2;          ///< above the target, m
  double min_sight = 0.35;          ///< least visibility score, m [0.2, 0.3]
  double safe = 0.55;               ///< least distance of nodes and edges to obstacles, m [0.2]
  double safe_retry = 0.45;
  double connect = 2.5;          ///< longest edge per second of a layer, m [3, 2]
  double weight_sight = 5.0;     ///< [5, 6]
  double weight_distance = 7.5;  ///< [7.5]
  double corridor = 0.28;        ///< half edge of the boxes, m [0.2, 0.3]
  int corridor_points = 3;       ///< per leg [3, 2]
  double weight_waypoint = 5.5;  ///< [5.5]
  double retry_factor = 1.5;     ///< on `connect`, then on `corridor`
};

}  // namespace chase::baselines
