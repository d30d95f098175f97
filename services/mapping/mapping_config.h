#pragma once

#include <string>

#include "common/world/ages.h"
#include "common/world/flight_volume.h"

namespace chase::mapping {

/// Local voxel grid: occupancy and free space around the drone.
struct GridConfig {
  double resolution = 0.2;   ///< edge of a cell, m
  double range = 20.0;       ///< returns beyond it only clear space up to it, m
  double min_range = 0.5;    ///< returns nearer are the drone itself, m
  int hit = 8;               ///< log-odds that a sweep's hit adds, tenths
  int miss = -4;             ///< log-odds that a sweep's ray through the cell adds, tenths
  int limit = 36;            ///< log-odds are kept within +- this, tenths
  int occupied = 12;         ///< a cell becomes occupied at this, and free again at zero or below
  int ever_free_sweeps = 3;  ///< consecutive free sweeps after which a return means motion

  template <class V>
  void Visit(V& v) {
    v("resolution", resolution, "edge of a cell, m");
    v("range", range, "returns beyond it only clear space up to it, m");
    v("min_range", min_range, "returns nearer are the drone itself, m");
    v("hit", hit, "log-odds that a sweep's hit adds, tenths");
    v("miss", miss, "log-odds that a sweep's ray through the cell adds, tenths; negative");
    v("limit", limit, "bound of the log-odds, tenths");
    v("occupied", occupied, "log-odds from which a cell is occupied, tenths");
    v("ever_free_sweeps", ever_free_sweeps, "free sweeps after which a return means motion");
  }
  std::string Problem() const;
};

/// Height of the gently rough ground.
struct GroundConfig {
  double margin = 0.2;  ///< returns up to this above the ground belong to it, m
  double step = 0.35;   ///< greatest jump between neighbouring tiles of 1 m, m

  template <class V>
  void Visit(V& v) {
    v("margin", margin, "returns up to this above the ground belong to it, m");
    v("step", step, "greatest jump between neighbouring 1 m tiles, m");
  }
  std::string Problem() const;
};

/// Decomposition of occupied columns into upright ellipsoids.
struct StaticConfig {
  double radius = world::kFlightVolume.around;  ///< obstacles within it of the drone are listed, m
  double band_low = 0.3;                        ///< flight volume above the ground, m
  double band_high = world::kFlightVolume.listed;  ///< the same, upper end, m
  double unseen = world::kFlightVolume.unseen;     ///< unseen columns within it are listed, m
  double semi_height = 8.0;                        ///< vertical semi-axis of the ellipsoids, m
  double max_length = 2.5;                         ///< longest piece of a wall, m
  double compact_radius = 0.5;  ///< pieces within such a circle count as round, m
  double waste = 0.2;           ///< blocked but not occupied area per length of a piece, m
  int tolerance_permille = 5;   ///< of the enclosing ellipses' area

  template <class V>
  void Visit(V& v) {
    v("radius", radius, "obstacles within this of the drone are listed, m");
    v("band_low", band_low, "lower end of the flight volume above the ground, m");
    v("band_high", band_high, "its upper end, m: z_max of planning and what of the body is above");
    v("unseen", unseen,
      "columns within this of the drone of which nothing was seen are listed, m: as far as it "
      "goes until it stands; 0: none");
    v("semi_height", semi_height, "vertical semi-axis of the ellipsoids, m");
    v("max_length", max_length, "longest piece of a wall, m");
    v("compact_radius", compact_radius, "pieces within such a circle count as round, m");
    v("waste", waste, "blocked but not occupied area per length of a piece, m");
    v("tolerance_permille", tolerance_permille, "of the enclosing ellipses' area");
  }
  std::string Problem() const;
};

/// Detection and tracking of what moves.
struct MoverConfig {
  int min_points = 8;          ///< returns of a cluster
  double cluster_cell = 0.25;  ///< clusters are connected in cells of this edge, m
  double max_size = 6.0;       ///< larger clusters are no movers, m
  double gate = 4.0;  ///< of the innovation, standard deviations; narrower for uncertain tracks
  double acceleration = 0.4;      ///< process noise, m/s^2
  double change_rate = 0.2;       ///< sudden changes of velocity, 1/s
  double change_speed = 1.0;      ///< standard deviation of such a change, per axis, m/s
  double measurement = 0.04;      ///< standard deviation of where an end is seen, m
  int confirm_sweeps = 4;         ///< detections in a row before a track may be listed
  double confirm_distance = 0.3;  ///< net travel before a track may be listed, m
  double confirm_speed = 0.3;     ///< speed before a track may be listed, m/s
  double lifetime = 4.0;          ///< mean time that what is out of sight still counts, s
  double settle = 2.0;            ///< what does not move for this becomes static, s
  double horizon = 3.0;           ///< length of the centre polynomials, s
  double sweep_time = 0.1;        ///< that the scanner takes for a turn, s; 0: sees all at once

  template <class V>
  void Visit(V& v) {
    v("min_points", min_points, "returns of a cluster");
    v("cluster_cell", cluster_cell, "clusters are connected in cells of this edge, m");
    v("max_size", max_size, "larger clusters are no movers, m");
    v("gate", gate, "of the innovation, standard deviations; narrower for uncertain tracks");
    v("acceleration", acceleration, "process noise, m/s^2");
    v("change_rate", change_rate, "sudden changes of velocity, 1/s");
    v("change_speed", change_speed, "standard deviation of such a change, per axis, m/s");
    v("measurement", measurement, "standard deviation of where an end is seen, m");
    v("confirm_sweeps", confirm_sweeps, "detections in a row before a track may be listed");
    v("confirm_distance", confirm_distance, "net travel before a track may be listed, m");
    v("confirm_speed", confirm_speed, "speed before a track may be listed, m/s");
    v("lifetime", lifetime, "mean time that what is out of sight still counts, s");
    v("settle", settle, "what does not move for this becomes static, s");
    v("horizon", horizon, "length of the centre polynomials, s");
    v("sweep_time", sweep_time, "that the scanner takes for a turn, s; 0: sees all at once");
  }
  std::string Problem() const;
};

/// The target's own points are no obstacle.
struct TargetConfig {
  double margin = 0.25;  ///< around the target's cylinder points are left out, m
  double core = 0.12;    ///< around its cylinder, while it is in view, settled cells are cleared, m
  /// The place is kept clear for this after it was last seen, s: as long as prediction forecasts
  /// it.
  double hold = world::kMostAge.target_unseen;

  template <class V>
  void Visit(V& v) {
    v("margin", margin, "around the target's cylinder within which points are left out, m");
    v("core", core,
      "around the target's cylinder, while it is in view, settled cells are cleared, m");
    v("hold", hold, "the predicted place is kept clear for this after it was last seen, s");
  }
  std::string Problem() const;
};

/// The octree that MAP carries.
struct TreeConfig {
  int updates_per_sweep = 6000;  ///< cells written at most
  double keep_radius = 40.0;     ///< tiles farther from the drone leave the tree, m
  bool keep_tiles = false;       ///< tiles that leave are handed out, for saving

  template <class V>
  void Visit(V& v) {
    v("updates_per_sweep", updates_per_sweep, "cells written at most");
    v("keep_radius", keep_radius, "tiles farther from the drone leave the tree, m");
    v("keep_tiles", keep_tiles, "tiles that leave are saved beside save_map");
  }
  std::string Problem() const;
};

struct MappingConfig {
  GridConfig grid;
  GroundConfig ground;
  StaticConfig statics;
  MoverConfig movers;
  TargetConfig target;
  TreeConfig tree;
  int max_obstacles = 120;  ///< listed at most
  double map_period = 1.0;  ///< between MAP messages, s
  std::string save_map;     ///< file (.bt) that receives the octree at the end; empty: none

  template <class V>
  void Visit(V& v) {
    v("grid", grid, "local voxel grid");
    v("ground", ground, "height of the ground");
    v("statics", statics, "decomposition into ellipsoids");
    v("movers", movers, "detection and tracking of what moves");
    v("target", target, "the target's own points");
    v("tree", tree, "octree");
    v("max_obstacles", max_obstacles, "listed at most");
    v("map_period", map_period, "between MAP messages, s");
    v("save_map", save_map, "file (.bt) that receives the octree at the end; empty: none");
  }
  std::string Problem() const;
};

}  // namespace chase::mapping
