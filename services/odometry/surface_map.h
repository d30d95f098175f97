#pragma once

#include <Eigen/Core>
#include <vector>

#include "services/odometry/cell_index.h"

namespace chase::odometry {

struct MapConfig {
  double cell_size = 0.3;    ///< of the finest level, m
  int levels = 4;            ///< each twice as coarse
  int max_points = 80;       ///< a cell stops learning there, so that the map stays put
  int max_cells = 60000;     ///< per level
  double keep_range = 60.0;  ///< cells farther from the drone are forgotten when the map is full, m
  double plane_thickness = 0.06;  ///< largest standard deviation across a plane, m

  template <class V>
  void Visit(V& v) {
    v("cell_size", cell_size, "of the finest level, m");
    v("levels", levels, "each twice as coarse as the one before");
    v("max_points", max_points, "a cell stops learning there, so that the map stays put");
    v("max_cells", max_cells, "per level; bounds the memory");
    v("keep_range", keep_range, "cells beyond it are forgotten first when the map is full, m");
    v("plane_thickness", plane_thickness, "largest standard deviation across a plane, m");
  }
};

/// A plane or a line as the map knows it. Frame W.
struct Surface {
  Eigen::Vector3f center = Eigen::Vector3f::Zero();     ///< m
  Eigen::Vector3f direction = Eigen::Vector3f::Zero();  ///< plane: normal; line: along it
  float variance = 0.0f;                                ///< of the points across it, m^2
};

/// What a cell must look like to serve.
enum class SurfaceKind { kPlane, kLine };

/// Hashed cells, each with the Gaussian of the points that fell into it, on several levels. A query
/// takes the finest level whose cell is a plane (or a line). Bounded in memory.
class SurfaceMap {
 public:
  SurfaceMap(const MapConfig& config, SurfaceKind kind);

  /// Learns a point. Frame W, m.
  void Add(const Eigen::Vector3f& p);

  /// The surface at p, or null where the map knows none.
  const Surface* Find(const Eigen::Vector3f& p) const;

  /// Forgets far cells of levels that are nearly full.
  void Prune(const Eigen::Vector3f& center);

  void Clear();
  size_t cells() const;
  size_t MemoryBytes() const;

 private:
  struct Cell {
    Eigen::Vector3f origin = Eigen::Vector3f::Zero();  // sums are relative to it
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    Eigen::Matrix3f outer = Eigen::Matrix3f::Zero();
    int n = 0;
    int next_fit = 5;  // points at which the surface is fitted again
    bool valid = false;
    Surface surface;
  };
  struct Level {
    float size = 1.0f;
    uint64_t Key(const Eigen::Vector3f& p) const { return CellKey(p + shift, 1.0f / size); }

    Eigen::Vector3f shift = Eigen::Vector3f::Zero();  // of the grid
    CellIndex index;
    std::vector<Cell> cells;
  };

  void Fit(const Level& level, Cell* cell) const;
  void PruneLevel(const Eigen::Vector3f& center, Level* level);

  MapConfig config_;
  SurfaceKind kind_;
  std::vector<Level> levels_;
};

}  // namespace chase::odometry
