#include "services/mapping/ray_walk.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace chase::mapping {

namespace {

#define CHASE_INLINE __attribute__((always_inline)) inline

// A ray a lane; the compiler lowers them to what the target has.
typedef double Reals __attribute__((vector_size(32)));
typedef int64_t Whole __attribute__((vector_size(32)));

constexpr double kUnclear = 1e-7;  // cells before and behind a border, more than rounding

/// One ray: its first and last cell, how the cell's number changes along each axis, the ray's
/// shares at the next borders and from border to border.
struct Ray {
  int cell, last, move[3];
  int steps;  ///< from border to border until the last cell
  double next[3], delta[3];
  int borders;   ///< that it crosses on all of its length
  bool unclear;  ///< if rounding may make that one more or less
};

constexpr int kLanes = 4;

/// Four of them.
struct Pack {
  Whole cell = {}, move[3] = {};
  Reals next[3] = {}, delta[3] = {};

  void Set(int lane, const Ray& ray) {
    cell[lane] = ray.cell;
    for (int k = 0; k < 3; ++k) {
      move[k][lane] = ray.move[k];
      next[k][lane] = ray.next[k];
      delta[k][lane] = ray.delta[k];
    }
  }
};

Ray Start(const VoxelGrid& grid, const Eigen::Vector3d& origin, const RayEnd& end) {
  constexpr int kMove[3] = {VoxelGrid::kSide * VoxelGrid::kLevels, VoxelGrid::kLevels, 1};
  const Eigen::Vector3d d = end.p - origin;
  const Key cell = grid.ToKey(origin);
  const int from[3] = {cell.x, cell.y, cell.z}, to[3] = {end.cell.x, end.cell.y, end.cell.z};
  Ray ray = {};
  ray.cell = ray.last = grid.Number(cell);
  if (!(d.norm() > 1e-6)) return ray;
  ray.last = grid.Number(end.cell);
  for (int k = 0; k < 3; ++k) {
    const bool up = d[k] > 0.0, moves = std::abs(d[k]) > 1e-12;
    ray.steps += std::abs(to[k] - from[k]);
    ray.move[k] = up ? kMove[k] : -kMove[k];
    ray.next[k] = ray.delta[k] = INFINITY;
    if (!moves) continue;
    ray.next[k] = (grid.resolution() * (from[k] + (up ? 1 : 0)) - origin[k]) / d[k];
    ray.delta[k] = grid.resolution() / std::abs(d[k]);
    const double borders = (1.0 - ray.next[k]) / ray.delta[k] + 1.0;
    if (borders < kUnclear) continue;
    ray.borders += static_cast<int>(borders);
    ray.unclear = ray.unclear || std::abs(borders - std::round(borders)) < kUnclear;
  }
  return ray;
}

CHASE_INLINE Reals Masked(Reals value, Whole mask) {
  return reinterpret_cast<Reals>(reinterpret_cast<Whole>(value) & mask);
}

/// To the next cell.
CHASE_INLINE void Step(Pack* pack) {
  Reals &x = pack->next[0], &y = pack->next[1], &z = pack->next[2];
  const Whole x_first = x < y;
  const Whole along_x = x_first & (x < z), along_y = ~x_first & (y < z);
  const Whole along_z = ~(along_x | along_y);
  pack->cell += (pack->move[0] & along_x) | (pack->move[1] & along_y) | (pack->move[2] & along_z);
  x += Masked(pack->delta[0], along_x);
  y += Masked(pack->delta[1], along_y);
  z += Masked(pack->delta[2], along_z);
}

/// The cells of all rays for as many steps. Two packs in turn, as each step waits for the one
/// before it.
CHASE_INLINE void WalkBody(const Pack* packs, int steps, int64_t* cells) {
  Pack a = packs[0], b = packs[1];
  for (int i = 0; i <= steps; ++i, cells += kRaysAtOnce) {
    memcpy(cells, &a.cell, sizeof a.cell);
    memcpy(cells + kLanes, &b.cell, sizeof b.cell);
    Step(&a);
    Step(&b);
  }
}

void WalkBaseline(const Pack* packs, int steps, int64_t* cells) { WalkBody(packs, steps, cells); }

#if defined(__x86_64__) && defined(__GNUC__)
__attribute__((target("avx2"))) void WalkAvx2(const Pack* packs, int steps, int64_t* cells) {
  WalkBody(packs, steps, cells);
}
const auto Walk = __builtin_cpu_supports("avx2") ? WalkAvx2 : WalkBaseline;
#else
constexpr auto Walk = WalkBaseline;
#endif

/// How many cells a ray visits, of those it comes to; where rounding lets it slip past the last one
/// it ends with its length.
int Visited(const Ray& ray, const int64_t* cells) {
  const bool arrives = ray.steps <= ray.borders && cells[ray.steps * kRaysAtOnce] == ray.last;
  return arrives ? ray.steps : ray.borders + 1;
}

/// The same for a ray of which it is unclear how many borders it crosses.
int VisitedAlone(Ray ray) {
  for (int n = 0;; ++n) {
    if (n == ray.steps && ray.cell == ray.last) return n;
    const int across = ray.next[0] < ray.next[1] ? 0 : 1;
    const int axis = ray.next[across] < ray.next[2] ? across : 2;
    if (ray.next[axis] > 1.0) return n + 1;
    ray.cell += ray.move[axis];
    ray.next[axis] += ray.delta[axis];
  }
}

}  // namespace

void WalkRays(const VoxelGrid& grid, const Eigen::Vector3d& origin, const RayEnd* ends, int n,
              const CellSet& done, CrossedCells* crossed) {
  Ray rays[kRaysAtOnce];
  Pack packs[kRaysAtOnce / kLanes];
  int most = 0;
  for (int i = 0; i < n; ++i) {
    rays[i] = Start(grid, origin, ends[i]);
    most = std::max({most, rays[i].steps, rays[i].borders + 1});
    packs[i / kLanes].Set(i % kLanes, rays[i]);
  }
  int64_t cells[(kMostCrossed + 1) * kRaysAtOnce];
  Walk(packs, most, cells);
  for (int i = 0; i < n; ++i) {
    const int visited = rays[i].unclear ? VisitedAlone(rays[i]) : Visited(rays[i], cells + i);
    int* out = crossed[i].cells;
    for (int k = 0; k < visited; ++k) {
      *out = static_cast<int>(cells[k * kRaysAtOnce + i]);
      out += done.Has(*out) ? 0 : 1;
    }
    crossed[i].count = static_cast<int>(out - crossed[i].cells);
  }
}

}  // namespace chase::mapping
