#pragma once

// Which solids a tile of rays may meet. For files compiled for AVX2.
#include "services/simulator/lanes.h"

namespace chase::simulator {
namespace {

constexpr int kMostNear = 64;  // solids that a fan of rays may meet
constexpr VI kLane = {0, 1, 2, 3, 4, 5, 6, 7};

/// Around all rays of a tile: they start within `spread` of o and leave the planes through o, with
/// normals n outwards, by at most `lean` of their way.
struct Fan {
  float o[3], n[4][3], spread[3], lean[4], longest;
};

inline void CrossOf(const float* a, const float* b, float* out) {
  for (int i = 0; i < 3; ++i)
    out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

inline float DotOf(const float* a, const float* b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

inline float Most(V v) {
  float values[8], most = -INFINITY;
  memcpy(values, &v, sizeof values);
  for (int i = 0; i < 8; ++i) most = values[i] > most ? values[i] : most;
  return most;
}

/// Unit normals, outwards, of the planes through the corner rays' neighbours.
inline void SetPlanes(const RayPacket* rays, int n, Fan* fan) {
  const RayPacket &first = rays[0], &last = rays[n - 1];
  const int a = first.count - 1, b = last.count - 1;
  const float corner[4][3] = {{first.dx[0], first.dy[0], first.dz[0]},
                              {first.dx[a], first.dy[a], first.dz[a]},
                              {last.dx[b], last.dy[b], last.dz[b]},
                              {last.dx[0], last.dy[0], last.dz[0]}};
  float mean[3];
  for (int i = 0; i < 3; ++i) mean[i] = corner[0][i] + corner[1][i] + corner[2][i] + corner[3][i];
  for (int p = 0; p < 4; ++p) {
    float* normal = fan->n[p];
    CrossOf(corner[p], corner[(p + 1) % 4], normal);
    const float norm = sqrtf(DotOf(normal, normal));
    const float scale = norm > 0.0f ? (DotOf(normal, mean) > 0.0f ? -1.0f : 1.0f) / norm : 0.0f;
    for (int i = 0; i < 3; ++i) normal[i] *= scale;
  }
}

/// Whatever the rays are, the fan holds them: by how much any of them leaves the planes is in it.
inline Fan FanOf(const RayPacket* rays, int n) {
  Fan fan;
  SetPlanes(rays, n, &fan);
  fan.o[0] = rays[0].ox[0], fan.o[1] = rays[0].oy[0], fan.o[2] = rays[0].oz[0];
  V longest = All(0), shortest = All(INFINITY), lean[4] = {}, spread[3] = {};
  for (int k = 0; k < n; ++k) {
    const VI used = kLane < rays[k].count;
    const V x = Load(rays[k].dx), y = Load(rays[k].dy), z = Load(rays[k].dz);
    const V squared = x * x + y * y + z * z;
    longest = Max(longest, Pick(used, squared, longest));
    shortest = Min(shortest, Pick(used, squared, shortest));
    const float* start[3] = {rays[k].ox, rays[k].oy, rays[k].oz};
    for (int i = 0; i < 3; ++i)
      spread[i] = Pick(used, Max(spread[i], Abs(Load(start[i]) - fan.o[i])), spread[i]);
    for (int p = 0; p < 4; ++p) {
      const V out = fan.n[p][0] * x + fan.n[p][1] * y + fan.n[p][2] * z;
      lean[p] = Pick(used, Max(lean[p], out), lean[p]);
    }
  }
  fan.longest = 1.0001f * sqrtf(Most(longest));
  const float scale = 1.0f / sqrtf(-Most(-shortest));
  for (int i = 0; i < 3; ++i) fan.spread[i] = Most(spread[i]) + 1e-3f;
  for (int p = 0; p < 4; ++p) fan.lean[p] = scale * Most(lean[p]) + 1e-5f;
  return fan;
}

/// Solids by eights with the boxes around them.
struct Near {
  BoundsNode boxes[kMostNear / 8];
  int count = 0;
  bool full = false;

  void Add(const BoundsNode& node, int i) {
    if (count == kMostNear) {
      full = true;
      return;
    }
    BoundsNode& to = boxes[count / 8];
    const int slot = to.count = count % 8;
    for (int k = 0; k < 3; ++k)
      to.center[k][slot] = node.center[k][i], to.half[k][slot] = node.half[k][i];
    to.child[slot] = node.child[i];
    ++to.count, ++count;
  }
};

/// Bits of the node's boxes that are not wholly beyond one of the planes, and how near they are.
inline unsigned Meets(const BoundsNode& node, const Fan& fan, V* distance) {
  const V3 c = {Load(node.center[0]) - fan.o[0], Load(node.center[1]) - fan.o[1],
                Load(node.center[2]) - fan.o[2]};
  const V3 h = {Load(node.half[0]) + fan.spread[0], Load(node.half[1]) + fan.spread[1],
                Load(node.half[2]) + fan.spread[2]};
  const V reach = Abs(c.x) + Abs(c.y) + Abs(c.z) + h.x + h.y + h.z;
  VI out = AllInt(0);
  for (int p = 0; p < 4; ++p) {
    const float* n = fan.n[p];
    const V side = n[0] * c.x + n[1] * c.y + n[2] * c.z;
    const V size = fabsf(n[0]) * h.x + fabsf(n[1]) * h.y + fabsf(n[2]) * h.z;
    out |= side - size > fan.lean[p] * reach;
  }
  const V3 gap = {Max(Abs(c.x) - h.x, All(0)), Max(Abs(c.y) - h.y, All(0)),
                  Max(Abs(c.z) - h.z, All(0))};
  *distance = Sqrt(Dot(gap, gap));
  return ~Bits(out) & ((1u << node.count) - 1u);
}

/// The world's solids that the fan may meet.
inline void Collect(const FacetWorld& world, const Fan& fan, Near* near) {
  int stack[64], depth = 0;
  if (world.node_count > 0) stack[depth++] = 0;
  while (depth > 0) {
    const BoundsNode& node = world.nodes[stack[--depth]];
    V gap;
    for (unsigned meets = Meets(node, fan, &gap); meets != 0; meets &= meets - 1) {
      const int i = __builtin_ctz(meets), child = node.child[i];
      if (child < 0)
        near->Add(node, i);
      else
        stack[depth++] = child;
    }
  }
}

/// Solids in the order of their distance.
struct Row {
  NearSolid solids[kMostNear];
  int count = 0;

  void Add(int solid, float least) {
    int i = count++;
    for (; i > 0 && solids[i - 1].least > least; --i) solids[i] = solids[i - 1];
    solids[i] = {solid, least};
  }
};

/// Those of the solids near a greater fan that a fan in it may meet.
inline void Sort(const Near& near, const Fan& fan, Row* row) {
  for (int first = 0; first < near.count; first += 8) {
    const BoundsNode& node = near.boxes[first / 8];
    V gap;
    unsigned meets = Meets(node, fan, &gap);
    float distance[8];
    memcpy(distance, &gap, sizeof distance);
    for (; meets != 0; meets &= meets - 1) {
      const int i = __builtin_ctz(meets);
      row->Add(~node.child[i], distance[i] / fan.longest);
    }
  }
}

}  // namespace
}  // namespace chase::simulator
