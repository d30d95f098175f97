#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "common/world/random.h"
#include "services/mapping/ray_walk.h"

namespace chase::mapping {
namespace {

using Eigen::Vector3d;

constexpr double kCell = 0.2;  // m

/// One ray cell by cell (Amanatides and Woo 1987), as it is written in textbooks.
std::vector<int> Walked(const VoxelGrid& grid, const Vector3d& origin, const RayEnd& end,
                        const CellSet& done) {
  std::vector<int> cells;
  const Vector3d d = end.p - origin;
  if (!(d.norm() > 1e-6)) return cells;
  const Key key = grid.ToKey(origin), last = end.cell;
  int at[3] = {key.x, key.y, key.z}, step[3];
  double next[3], delta[3];
  for (int k = 0; k < 3; ++k) {
    const bool moves = std::abs(d[k]) > 1e-12;
    step[k] = d[k] > 0.0 ? 1 : -1;
    next[k] = moves ? (kCell * (at[k] + (d[k] > 0.0 ? 1 : 0)) - origin[k]) / d[k] : INFINITY;
    delta[k] = moves ? kCell / std::abs(d[k]) : INFINITY;
  }
  int steps = std::abs(last.x - at[0]) + std::abs(last.y - at[1]) + std::abs(last.z - at[2]);
  for (; steps != 0 || !(Key{at[0], at[1], at[2]} == last); --steps) {
    const int cell = grid.Number({at[0], at[1], at[2]});
    if (!done.Has(cell)) cells.push_back(cell);
    int axis = next[0] < next[1] ? 0 : 1;
    axis = next[axis] < next[2] ? axis : 2;
    if (next[axis] > 1.0) break;
    at[axis] += step[axis];
    next[axis] += delta[axis];
  }
  return cells;
}

/// An end somewhere in the window: mostly in the cell that it is said to be in, and some on borders
/// of cells, right along an axis, beside their cell, or at the origin.
RayEnd RandomEnd(const VoxelGrid& grid, const Vector3d& origin, world::Random* random) {
  RayEnd end;
  for (int k = 0; k < 3; ++k) end.p[k] = random->Uniform(-1.0, 1.0) * (k < 2 ? 20.0 : 2.5);
  const int kind = static_cast<int>(random->Next() % 12);
  if (kind < 3) end.p[kind] = origin[kind];
  if (kind < 6 && kind >= 3) end.p[kind - 3] = kCell * std::round(end.p[kind - 3] / kCell);
  if (kind == 6) end.p = origin;
  end.cell = grid.ToKey(end.p);
  if (kind == 7) end.cell.x &= ~1, end.cell.y &= ~1;
  return end;
}

TEST(RayWalk, EveryRayCrossesTheCellsThatItCrossesAlone) {
  world::Random random(1);
  VoxelGrid grid(kCell);
  CellSet done;
  for (int round = 0; round < 400; ++round) {
    const Vector3d origin(random.Uniform(-2.0, 2.0), random.Uniform(-2.0, 2.0),
                          random.Uniform(-0.5, 0.5));
    grid.MoveTo(origin);
    grid.SettledFree(&done);
    for (int i = 0; i < 100000; ++i) done.Add(static_cast<int>(random.Next() % (1u << 21)));
    const int n = 1 + round % kRaysAtOnce;
    RayEnd ends[kRaysAtOnce];
    for (int i = 0; i < n; ++i) ends[i] = RandomEnd(grid, origin, &random);
    CrossedCells crossed[kRaysAtOnce];
    WalkRays(grid, origin, ends, n, done, crossed);
    for (int i = 0; i < n; ++i) {
      const std::vector<int> cells(crossed[i].cells, crossed[i].cells + crossed[i].count);
      EXPECT_EQ(cells, Walked(grid, origin, ends[i], done)) << "round " << round << " ray " << i;
    }
  }
}

TEST(RayWalk, NumbersOfCellsAreTheirsWhereverTheWindowIs) {
  VoxelGrid grid(kCell);
  for (const double x : {-731.3, 0.0, 52.1}) {
    const Vector3d p(x, 0.7 * x, 0.1 * x);
    grid.MoveTo(p);
    for (const Key& d : {Key{0, 0, 0}, Key{-128, -128, -16}, Key{127, 127, 15}, Key{3, -50, 9}}) {
      const Key middle = grid.ToKey(p), key{middle.x + d.x, middle.y + d.y, grid.z0() + 16 + d.z};
      ASSERT_TRUE(grid.Contains(key));
      EXPECT_EQ(grid.KeyOf(grid.Number(key)), key);
    }
  }
}

TEST(RayWalk, SettledCellsKeepTheirPlaceWhenTheWindowMoves) {
  VoxelGrid grid(kCell);
  grid.MoveTo({0.0, 0.0, 0.0});
  const Key key = {20, -30, 5};
  grid.settled_free()[VoxelGrid::Index(key.x, key.y)] |= VoxelGrid::Bit(key.z);
  for (const Vector3d& p : {Vector3d(0.0, 0.0, 0.0), Vector3d(5.3, -9.1, 0.4)}) {
    grid.MoveTo(p);
    CellSet settled;
    grid.SettledFree(&settled);
    for (int cell = 0; cell < 1 << 21; ++cell)
      ASSERT_EQ(settled.Has(cell), cell == grid.Number(key)) << cell;
  }
}

}  // namespace
}  // namespace chase::mapping
