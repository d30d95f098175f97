#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "common/math/huge_page_allocator.h"
#include "services/mapping/mapping_config.h"

namespace chase::mapping {

/// Integer cell coordinates: floor(x / resolution), frame W.
struct Key {
  int x = 0, y = 0, z = 0;
  bool operator==(const Key& o) const { return x == o.x && y == o.y && z == o.z; }
};

/// floor(x), without a call of the library; |x| < 2^31.
inline int Floor(double x) {
  const int i = static_cast<int>(x);
  return i - (x < i);
}

/// Where in a cell its returns lie: intervals along x, y, (x+y)/sqrt2, (x-y)/sqrt2 and z about the
/// cell's centre. An octagon in plan that hugs round and slanted surfaces where a cell does not.
struct Extent {
  static constexpr int kAxes = 5;
  std::array<int8_t, kAxes> low{}, high{};  ///< in steps of VoxelGrid::step()
  bool empty() const { return low[0] > high[0]; }
  static constexpr Extent Nothing() { return {{1, 1, 1, 1, 1}, {-1, -1, -1, -1, -1}}; }
};

struct Voxel {
  int8_t log_odds = 0;      ///< tenths
  uint8_t free_sweeps = 0;  ///< consecutive sweeps seen free; kept through the first hits
  uint8_t hits = 0;         ///< sweeps that hit it since it was last free
  uint8_t moving_hits = 0;  ///< consecutive sweeps in which moving returns lay in it
  int8_t free_down_to = 0;  ///< lowest of the first rays that freed it, steps about the centre
  bool occupied : 1, queued : 1;      ///< queued: waits for being written to the octree
  Extent extent = Extent::Nothing();  ///< of its returns above the ground
  uint32_t sweep = 0;                 ///< last sweep that hit it, or freed it while not settled
  uint32_t hit_sweep = 0;             ///< last sweep that hit it
  int32_t slot = 0;                   ///< index into that sweep's hit cells

  Voxel() : occupied(false), queued(false) {}
};
static_assert(sizeof(Voxel) == 28, "two million of them");

/// Cells of the window by number: the levels of a column lie together, then columns along y.
class CellSet {
 public:
  bool Has(int cell) const { return columns_[Column(cell)] >> Level(cell) & 1u; }
  void Add(int cell) { columns_[Column(cell)] |= 1u << Level(cell); }
  std::vector<uint32_t>& columns() { return columns_; }

 private:
  static size_t Column(int cell) { return static_cast<uint32_t>(cell) / 32u; }
  static uint32_t Level(int cell) { return static_cast<uint32_t>(cell) % 32u; }

  std::vector<uint32_t> columns_;
};

/// Rolling window of cells around the drone, kSide x kSide columns of kLevels cells. A column is
/// reset when it is first touched after the window moved onto it, so that moving costs nothing.
class VoxelGrid {
 public:
  static constexpr int kSide = 256, kLevels = 32;
  /// Cells ahead to Prefetch: one takes 10 to 20 ns, memory answers after about 100.
  static constexpr size_t kAhead = 8;

  struct Column {
    int x = INT32_MIN, y = INT32_MIN, z0 = 0;  ///< the cells that it stands for
    int piece = 0;                             ///< of the static decomposition; 0: none
    int occupied = 0;                          ///< cells that are occupied with an extent
    Voxel* voxels = nullptr;                   ///< kLevels; apart, so that columns stay in cache
  };

  explicit VoxelGrid(double resolution);
  VoxelGrid(const VoxelGrid&) = delete;

  double resolution() const { return resolution_; }
  /// Length of one step of an Extent, m.
  double step() const { return step_; }
  Key ToKey(const Eigen::Vector3d& p) const {
    const Eigen::Array3d c = (p.array() / resolution_).max(-1e9).min(1e9);
    return {Floor(c.x()), Floor(c.y()), Floor(c.z())};
  }
  Eigen::Vector3d Center(const Key& k) const {
    return resolution_ * Eigen::Vector3d(k.x + 0.5, k.y + 0.5, k.z + 0.5);
  }

  /// Centres the window on p. Forgets what falls out.
  void MoveTo(const Eigen::Vector3d& p);
  bool Contains(const Key& k) const { return ContainsColumn(k.x, k.y) && ContainsLevel(k.z); }
  bool ContainsColumn(int x, int y) const {
    return x >= x0_ && x < x0_ + kSide && y >= y0_ && y < y0_ + kSide;
  }
  bool ContainsLevel(int z) const { return z >= z0_ && z < z0_ + kLevels; }
  int z0() const { return z0_; }

  /// The column of (x, y), which must be in the window; reset if it was another's.
  Column& Touch(int x, int y) {
    Column& column = Slot(x, y);
    if (column.x != x || column.y != y || column.z0 != z0_) Renew(&column, x, y);
    return column;
  }
  /// The column of (x, y), or null where nothing was seen.
  Column* Find(int x, int y) {
    if (!ContainsColumn(x, y)) return nullptr;
    Column& column = Slot(x, y);
    if (column.x != x || column.y != y) return nullptr;
    if (column.z0 != z0_) Renew(&column, x, y);
    return &column;
  }
  static size_t Level(int z) { return static_cast<size_t>(z & (kLevels - 1)); }
  static uint32_t Bit(int z) { return uint32_t{1} << Level(z); }
  static size_t Index(int x, int y) {
    return static_cast<size_t>((x & (kSide - 1)) * kSide + (y & (kSide - 1)));
  }
  /// Number of a cell of the window, by its place in it.
  int Number(const Key& k) const {
    return ((k.x - x0_) * kSide + (k.y - y0_)) * kLevels + (k.z - z0_);
  }
  Key KeyOf(int number) const {
    const int column = number / kLevels;
    return {x0_ + column / kSide, y0_ + column % kSide, z0_ + number % kLevels};
  }
  /// Fetches the memory of a cell that is needed soon; it need not be in the window.
  void Prefetch(const Key& k) const {
    __builtin_prefetch(&columns_[Index(k.x, k.y)]);
    __builtin_prefetch(&voxels_[Index(k.x, k.y) * kLevels + Level(k.z)]);
  }
  /// The voxel, or null where nothing was seen.
  Voxel* At(const Key& k);

  /// A bit per level of each column in the window (Index, Bit): cells that another free sweep would
  /// leave as they are. Small, so that rays need not look at the cells themselves.
  std::vector<uint32_t>& settled_free() { return settled_free_; }
  /// The same by number.
  void SettledFree(CellSet* cells) const;

  size_t Bytes() const {
    return columns_.size() * (sizeof(Column) + kLevels * sizeof(Voxel) + sizeof(uint32_t));
  }

 private:
  Column& Slot(int x, int y) { return columns_[Index(x, y)]; }
  void Renew(Column* column, int x, int y) const;

  double resolution_, step_;
  int x0_ = 0, y0_ = 0, z0_ = 0;
  bool placed_ = false;
  template <class T>
  using Array = std::vector<T, math::HugePageAllocator<T>>;
  Array<Column> columns_;
  Array<Voxel> voxels_;
  std::vector<uint32_t> settled_free_;
};

/// Interval of a point set within one cell; metres about the cell's centre.
struct ExtentMeter {
  std::array<float, Extent::kAxes> low, high;
  ExtentMeter();
  void Add(const Eigen::Vector3f& d);
};

/// Lets `extent` follow a sweep's interval: outward by half of the difference, inward by a tenth
/// where the difference is of the size of noise (`noise` m), not of a partial view.
void Follow(const ExtentMeter& seen, double step, double noise, Extent* extent);

/// Corners in plan (x, y; frame W, m) of the octagon that bounds the extent, up to eight.
int PlanCorners(const Extent& extent, const Eigen::Vector2d& center, double step,
                std::array<Eigen::Vector2d, 8>* corners);

/// The smallest extent that holds both.
Extent Union(const Extent& a, const Extent& b);

}  // namespace chase::mapping
