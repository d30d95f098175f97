#pragma once

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "common/math/huge_page_allocator.h"
#include "services/odometry/cell_index.h"

namespace chase::odometry {

struct MapConfig {
  double cell_size = 0.3;    ///< of the finest level, m
  int levels = 4;            ///< each twice as coarse
  int max_points = 160;      ///< a cell stops learning there, so that the map stays put
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
  Eigen::Vector3f direction = Eigen::Vector3f::Zero();  ///< plane: normal out of it; line: along it
  float variance = 0.0f;                                ///< of the points across it, m^2
};

/// A place in the map and the surface there, null where the map knows none.
struct Query {
  Eigen::Vector3f p = Eigen::Vector3f::Zero();  ///< frame W, m
  /// The answer holds wherever no coordinate differs by more from p [m]; negative before the first
  /// answer, and where rounding leaves no room.
  float reach = -1.0f;
  const Surface* surface = nullptr;
};

/// What a cell must look like to serve.
enum class SurfaceKind { kPlane, kLine };

/// Hashed cells, each with the Gaussian of the points that fell into it, on several levels. A query
/// takes the finest level whose cell is a plane (or a line). A plane shows one face: a cell that is
/// seen from behind its plane has a second Gaussian, of the other face of a wall. Bounded in
/// memory.
class SurfaceMap {
 public:
  SurfaceMap(const MapConfig& config, SurfaceKind kind);

  /// Learns points in their order, seen from `eye`. Frame W, m.
  void Add(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3f& eye);

  /// The surface at p that is seen from `eye`, or null where the map knows none.
  const Surface* Find(const Eigen::Vector3f& p, const Eigen::Vector3f& eye) const;

  /// The same for many places.
  void Find(std::vector<Query*> queries, const Eigen::Vector3f& eye) const;

  /// Forgets far cells of levels that are nearly full.
  void Prune(const Eigen::Vector3f& center);

  void Clear();
  size_t cells() const;
  size_t MemoryBytes() const;

 private:
  /// The points of one cell. Sums are relative to its first point.
  struct alignas(64) Moments {
    void Add(const Eigen::Vector3f& p) {
      const Eigen::Vector3f d = p - origin;
      sum += d;
      squares += d.cwiseProduct(d);
      products += Eigen::Vector3f(d.x() * d.y(), d.y() * d.z(), d.z() * d.x());
      ++n;
    }

    Eigen::Vector3f origin = Eigen::Vector3f::Zero();
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    Eigen::Vector3f squares = Eigen::Vector3f::Zero();   // xx yy zz
    Eigen::Vector3f products = Eigen::Vector3f::Zero();  // xy yz zx
    int n = 0;
    int next_fit = 5;   // points at which the surface is fitted again
    uint64_t face = 0;  // as CellKey's highest bit: the one seen from behind the other
  };
  struct alignas(32) Fitted {
    bool valid() const { return tilt >= 0.0f; }
    /// Seen from behind, by more than the noise of the normal explains.
    bool IsHidden(const Eigen::Vector3f& eye) const;

    Surface surface;
    float tilt = -1.0f;  // standard deviation of the normal, rad; negative: no surface
  };
  struct Level {
    /// A point in units of the cells.
    Eigen::Vector3f Scaled(const Eigen::Vector3f& p) const { return (p + shift) * inverse_size; }
    size_t CellOf(uint64_t key, const Eigen::Vector3f& p, const Eigen::Vector3f& eye);
    size_t FaceOf(uint64_t key, const Eigen::Vector3f& p);
    const Surface* At(uint64_t key, const Eigen::Vector3f& eye) const;

    float size = 1.0f, inverse_size = 1.0f;
    Eigen::Vector3f shift = Eigen::Vector3f::Zero();  // of the grid
    CellIndex index;
    template <class T>
    using Array = std::vector<T, math::HugePageAllocator<T>>;
    Array<Moments> moments;  // what cells learn from and
    Array<Fitted> fitted;    // what queries read, by the cell's number
  };

  /// What AddTo works with, kept so that sweeps need no new memory.
  struct Scratch {
    std::vector<uint64_t> keys;                   // of the points' cells
    std::vector<size_t> cells;                    // their numbers
    std::vector<std::pair<size_t, Moments>> due;  // cells to be fitted and to what
  };

  void AddTo(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3f& eye, Level* level);
  Fitted Fit(const Level& level, const Moments& moments, const Eigen::Vector3f& eye) const;
  void PruneLevel(const Eigen::Vector3f& center, Level* level);

  MapConfig config_;
  SurfaceKind kind_;
  std::vector<Level> levels_;
  Scratch scratch_;
};

}  // namespace chase::odometry
