#pragma once

// For files compiled for AVX2.
#include "services/simulator/lanes.h"

namespace chase::simulator {
namespace {

constexpr int kMostCells = 256;     // on a ray's way
constexpr float kCellEdge = 1e-3f;  // share of a triangle at its edges that is not settled, at most
constexpr float kAboveTop = 1e-3f;  // m, more than the rounding of a height

__attribute__((always_inline)) inline void CrossCell(const GroundGrid& ground, VI ix, VI iy,
                                                     VI* lanes, Lanes* ray) {
  const VI first = iy * (ground.columns + 1) + ix;
  int i[8], j[8], low[8];
  memcpy(i, &ix, sizeof i), memcpy(j, &iy, sizeof j), memcpy(low, &first, sizeof low);
  V at[4], z[4];
  Transpose([&](int k) { return Pairs(ground.x + i[k], ground.y + j[k]); }, at);
  const float* high = ground.z + ground.columns + 1;
  Transpose([&](int k) { return Pairs(ground.z + low[k], high + low[k]); }, z);
  const V3 a = {at[0], at[2], z[0]}, b = {at[1], at[2], z[1]};
  const V3 d = {at[0], at[3], z[2]}, e = {at[1], at[3], z[3]};
  const Triangle halves[2] = {TriangleOf(a, b, e), TriangleOf(a, e, d)};
  const V way = Sum(a - ray->o) / ground.cells_per_m[0];
  VI settled = AllInt(0);
  for (const Triangle& triangle : halves) {
    const Crossing x = Cross(*ray, triangle);
    const V edge = EdgeMargin(x, kCellEdge, way);
    const VI found = *lanes & x.Inside(edge);
    ray->unsure |= *lanes & x.Inside(-edge) & ~found;
    Keep(x, triangle.n, found, AllInt(static_cast<int>(Material::kGround)), ray);
    settled |= found;
  }
  *lanes &= ~(settled | ray->unsure);
}

/// From cell to cell of the grid (Amanatides and Woo 1987), from where the ray comes below the
/// highest of the ground. A ray that may meet its cell waits until all others do or have passed.
__attribute__((always_inline)) inline void CrossGround(const GroundGrid& ground, VI todo,
                                                       Lanes* ray) {
  if (ground.columns == 1 && ground.rows == 1)
    return CrossCell(ground, AllInt(0), AllInt(0), &todo, ray);
  const float* plane = ground.plane;
  const V height = ray->o.z - (plane[0] + plane[1] * ray->o.x + plane[2] * ray->o.y);
  const V climb = ray->d.z - (plane[1] * ray->d.x + plane[2] * ray->d.y);
  V t = Max((ground.highest - height) / Pick(climb < 0.0f, climb, All(-1e-12f)), All(0.0f));
  todo &= (height <= ground.highest) | (climb < 0.0f);
  const V gx = (ray->o.x - ground.x[0]) * ground.cells_per_m[0];
  const V gy = (ray->o.y - ground.y[0]) * ground.cells_per_m[1];
  const V dx = ray->d.x * ground.cells_per_m[0], dy = ray->d.y * ground.cells_per_m[1];
  const V rx = 1.0f / Pick(Abs(dx) > 1e-12f, dx, All(1e-12f));
  const V ry = 1.0f / Pick(Abs(dy) > 1e-12f, dy, All(1e-12f));
  const V ax = -gx * rx, bx = (static_cast<float>(ground.columns) - gx) * rx;
  const V ay = -gy * ry, by = (static_cast<float>(ground.rows) - gy) * ry;
  t = Max(t, Max(Min(ax, bx), Min(ay, by)));
  const V end = Min(Min(Max(ax, bx), Max(ay, by)), ray->t);
  todo &= t <= end;
  if (Bits(todo) == 0) return;
  const VI last_x = AllInt(ground.columns - 1), last_y = AllInt(ground.rows - 1);
  VI ix = Whole(Floor(Fma(t, dx, gx))), iy = Whole(Floor(Fma(t, dy, gy)));
  ix = Pick(ix < 0, AllInt(0), Pick(ix > last_x, last_x, ix));
  iy = Pick(iy < 0, AllInt(0), Pick(iy > last_y, last_y, iy));
  const VI step_x = (rx < 0.0f) | 1, step_y = (ry < 0.0f) | 1;
  const VI ahead_x = (rx > 0.0f) & 1, ahead_y = (ry > 0.0f) & 1;
  for (int i = 0; i < kMostCells; ++i) {
    const V tx = (Real(ix + ahead_x) - gx) * rx, ty = (Real(iy + ahead_y) - gy) * ry;
    const V next = Min(tx, ty);
    const V lowest = Fma(Pick(climb < 0.0f, next, t), climb, height) - kAboveTop;
    const VI meets = todo & (lowest <= Gather(ground.top, iy * ground.columns + ix));
    VI on = todo & ~meets;
    if (Bits(on) == 0) {
      on = meets;
      CrossCell(ground, ix, iy, &on, ray);
      todo = on;
    }
    const VI along_x = tx <= ty;
    ix += step_x & along_x & on, iy += step_y & ~along_x & on;
    t = Pick(on, next, t);
    todo &= (t <= Min(end, ray->t)) & (ix >= 0) & (ix <= last_x) & (iy >= 0) & (iy <= last_y);
    todo &= (climb < 0.0f) | (Fma(t, climb, height) <= ground.highest);
    if (Bits(todo) == 0) return;
    ix = Pick(todo, ix, AllInt(0)), iy = Pick(todo, iy, AllInt(0));
  }
  ray->unsure |= todo;
}

}  // namespace
}  // namespace chase::simulator
