// Compiled for AVX2 and FMA on x86, like shading.cpp, and plain as it is.
#include "services/simulator/facets.h"

#ifdef __AVX2__

#include "services/simulator/ground_tracer.h"
#include "services/simulator/lanes.h"

namespace chase::simulator {
namespace {

constexpr int kMostNear = 64;   // solids that a fan of rays may meet
constexpr float kEdge = 2e-4f;  // share of a facet at its edges where a hit is not settled
constexpr float kPi = 3.14159265f;
constexpr int kRounds = 4;      // of the search for the facet
constexpr int kRowPackets = 4;  // of a tile, with one list of solids

constexpr VI kLane = {0, 1, 2, 3, 4, 5, 6, 7};

/// Around all rays of a tile: they start within `spread` of o and leave the planes through o, with
/// normals n outwards, by at most `lean` of their way.
struct Fan {
  float o[3], n[4][3], spread[3], lean[4], longest;
};

void CrossOf(const float* a, const float* b, float* out) {
  for (int i = 0; i < 3; ++i)
    out[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

float DotOf(const float* a, const float* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

float Most(V v) {
  float values[8], most = -INFINITY;
  memcpy(values, &v, sizeof values);
  for (int i = 0; i < 8; ++i) most = values[i] > most ? values[i] : most;
  return most;
}

/// Unit normals, outwards, of the planes through the corner rays' neighbours.
void SetPlanes(const RayPacket* rays, int n, Fan* fan) {
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
Fan FanOf(const RayPacket* rays, int n) {
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
unsigned Meets(const BoundsNode& node, const Fan& fan, V* distance) {
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
void Collect(const FacetWorld& world, const Fan& fan, Near* near) {
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

/// Solids in the order of their distance, m.
struct Row {
  int solid[kMostNear], count = 0;
  float distance[kMostNear];

  void Add(int s, float d) {
    int i = count++;
    for (; i > 0 && distance[i - 1] > d; --i)
      distance[i] = distance[i - 1], solid[i] = solid[i - 1];
    distance[i] = d, solid[i] = s;
  }
};

/// Those of the solids near a greater fan that a fan in it may meet.
void Sort(const Near& near, const Fan& fan, Row* row) {
  for (int first = 0; first < near.count; first += 8) {
    const BoundsNode& node = near.boxes[first / 8];
    V gap;
    unsigned meets = Meets(node, fan, &gap);
    float distance[8];
    memcpy(distance, &gap, sizeof distance);
    for (; meets != 0; meets &= meets - 1) {
      const int i = __builtin_ctz(meets);
      row->Add(~node.child[i], distance[i]);
    }
  }
}

/// atan(y / x) over the whole turn, to 1e-5. Abramowitz and Stegun 1964, 4.4.49.
V Angle(V y, V x) {
  const V ax = Abs(x), ay = Abs(y);
  const V a = Min(ax, ay) / Max(Max(ax, ay), All(1e-30f)), s = a * a;
  const float k[] = {0.0208351f, -0.0851330f, 0.1801410f, -0.3302995f, 0.9998660f};
  V r = All(k[0]);
  for (int i = 1; i < 5; ++i) r = Fma(r, s, All(k[i]));
  r = r * a;
  r = Pick(ay > ax, 0.5f * kPi - r, r);
  r = Pick(x < 0.0f, kPi - r, r);
  return Xor(r, Sign(y));
}

/// The rays in the solid's own axes, its half sizes one.
Lanes UnitRays(const FacetSolid& solid, const Lanes& ray) {
  const float c = solid.cos_yaw, s = solid.sin_yaw, *per = solid.per_half;
  const V3 o = {ray.o.x - solid.center[0], ray.o.y - solid.center[1], ray.o.z - solid.center[2]};
  Lanes unit = {};
  unit.o = {per[0] * (c * o.x + s * o.y), per[1] * (c * o.y - s * o.x), per[2] * o.z};
  unit.d = {per[0] * (c * ray.d.x + s * ray.d.y), per[1] * (c * ray.d.y - s * ray.d.x),
            per[2] * ray.d.z};
  return unit;
}

/// Where the rays are inside a body around the solid.
struct Span {
  V enter, leave;
};

Span Both(const Span& a, const Span& b) { return {Max(a.enter, b.enter), Min(a.leave, b.leave)}; }

Span Slab(V o, V d, V half) {
  const V rate = 1.0f / Pick(Abs(d) > 1e-12f, d, All(1e-12f));
  const V a = (-half - o) * rate, b = (half - o) * rate;
  return {Min(a, b), Max(a, b)};
}

/// Rays that miss the ball of a radius around the origin. By the cross product, as the discriminant
/// cancels far away.
VI Misses(const V3& o, const V3& d, V radius) {
  const V3 moment = Cross(o, d);
  return Dot(moment, moment) > radius * radius * Dot(d, d);
}

Span Ball(const V3& o, const V3& d, V radius) {
  const V squared = Dot(d, d) + 1e-20f, closest = -Dot(o, d) / squared;
  const V3 q = Along(o, closest, d);
  const V chord = Sqrt(Max(radius * radius - Dot(q, q), All(0.0f)) / squared);
  return {closest - chord, closest + chord};
}

/// A triangle for each lane: a quad and which half of it.
struct Choice {
  VI quad, half;
};

/// Numbers of a triangle's vertices, counted from the solid's first.
struct Corners {
  VI v[3];
};

/// Column of the edge around the axis, and where between its ends.
void Column(const FacetSolid& solid, const V3& p, VI* column, V* share) {
  const float n = static_cast<float>(solid.around);
  V turn = Angle(p.y, p.x) * (0.5f / kPi);
  turn = n * (turn - Floor(turn));
  const V whole = Min(Floor(turn), All(n - 1.0f));
  *column = Whole(whole), *share = turn - whole;
}

Choice BoxChoice(const Lanes& unit, V margin) {
  const V x = Slab(unit.o.x, unit.d.x, margin).enter, y = Slab(unit.o.y, unit.d.y, margin).enter,
          z = Slab(unit.o.z, unit.d.z, margin).enter;
  const VI on_z = (z >= x) & (z >= y), on_y = (y >= x) & ~on_z;
  const V d = Pick(on_z, unit.d.z, Pick(on_y, unit.d.y, unit.d.x));
  const VI face = Pick(on_z, AllInt(0), Pick(on_y, AllInt(2), AllInt(4)));
  return {face - (d < 0.0f), AllInt(0)};
}

/// The quads of the side, and after them the caps: below and above.
Choice CylinderChoice(const FacetSolid& solid, const V3& p, VI cap) {
  VI column;
  V share;
  Column(solid, p, &column, &share);
  const VI side_half = (share < 0.5f * (p.z + 1.0f)) & 1;
  return {Pick(cap, solid.around + column, column), Pick(cap, (p.z > 0.0f) & 1, side_half)};
}

/// By the point's direction from the centre, along which the quads' edges are straight.
Choice EllipsoidChoice(const FacetSolid& solid, const V3& p) {
  VI column;
  V share;
  Column(solid, p, &column, &share);
  const float step = 2.0f * kPi / static_cast<float>(solid.around);
  const V off = step * (share - 0.5f), s = off * off;
  const float chord = 1.0f - step * step * (1.0f / 8.0f) + step * step * step * step * (1.0f / 384);
  const V out = Sqrt(p.x * p.x + p.y * p.y) * (1.0f - s * (0.5f - s * (1.0f / 24))) / chord;
  const float rows = static_cast<float>(solid.rows);
  const V height = rows * (Angle(p.z, out) * (1.0f / kPi) + 0.5f);
  const V whole = Min(Max(Floor(height), All(0.0f)), All(rows - 1.0f));
  const VI row = Whole(whole);
  const VI pole = Pick(row == 0, AllInt(1), (share < height - whole) & 1);
  return {row * solid.around + column, Pick(row == solid.rows - 1, AllInt(0), pole)};
}

/// As SolidMesh() lists them.
Corners BoxCorners(const Choice& choice) {
  alignas(32) static const int kCorners[3][16] = {{0, 0, 4, 4, 0, 0, 2, 2, 0, 0, 1, 1},
                                                  {2, 3, 5, 7, 1, 5, 6, 7, 4, 6, 3, 7},
                                                  {3, 1, 7, 6, 5, 4, 7, 3, 6, 2, 7, 5}};
  const VI index = 2 * choice.quad + choice.half;
  Corners corners;
  for (int i = 0; i < 3; ++i)
    corners.v[i] = (VI)_mm256_i32gather_epi32(kCorners[i], (__m256i)index, 4);
  return corners;
}

/// Quads between two rows of vertices.
Corners QuadCorners(const FacetSolid& solid, const Choice& choice, VI row) {
  const int n = solid.around;
  const VI a = choice.quad, column = a - row * n;
  const VI b = Pick(column == n - 1, a - column, a + 1), upper = choice.half != 0;
  return {{a, Pick(upper, b + n, b), Pick(upper, a + n, b + n)}};
}

Corners CylinderCorners(const FacetSolid& solid, const Choice& choice) {
  const int n = solid.around;
  const VI cap = choice.quad >= n, top = choice.half != 0;
  const VI i = Pick(cap, choice.quad - n, choice.quad), next = Pick(i == n - 1, AllInt(0), i + 1);
  const Corners side = QuadCorners(solid, {i, choice.half}, AllInt(0));
  return {{Pick(cap, 2 * n + choice.half, side.v[0]), Pick(cap, Pick(top, n + i, next), side.v[1]),
           Pick(cap, Pick(top, n + next, i), side.v[2])}};
}

Corners CornersOf(const FacetSolid& solid, const Choice& choice) {
  if (solid.kind == FacetSolid::Kind::kBox) return BoxCorners(choice);
  if (solid.kind == FacetSolid::Kind::kCylinder) return CylinderCorners(solid, choice);
  const V row = Floor((Real(choice.quad) + 0.5f) / static_cast<float>(solid.around));
  return QuadCorners(solid, choice, Whole(row));
}

/// A vertex for each lane.
V3 Vertices(const FacetVertex* base, VI index) {
  int at[8];
  memcpy(at, &index, sizeof at);
  __m256 row[4];
  for (int i = 0; i < 4; ++i)
    row[i] = _mm256_set_m128(_mm_load_ps(base[at[i + 4]].p), _mm_load_ps(base[at[i]].p));
  const __m256 a = _mm256_unpacklo_ps(row[0], row[1]), b = _mm256_unpackhi_ps(row[0], row[1]);
  const __m256 c = _mm256_unpacklo_ps(row[2], row[3]), d = _mm256_unpackhi_ps(row[2], row[3]);
  return {(V)_mm256_shuffle_ps(a, c, 0x44), (V)_mm256_shuffle_ps(a, c, 0xee),
          (V)_mm256_shuffle_ps(b, d, 0x44)};
}

/// Where the rays may be within the solid: a span of a body slightly larger, and, of a cylinder,
/// the lanes that enter it by a cap.
VI Within(const FacetSolid& solid, const Lanes& unit, V size, Span* span, VI* cap) {
  const V3 &o = unit.o, &d = unit.d;
  if (solid.kind == FacetSolid::Kind::kEllipsoid) {
    const VI misses = Misses(o, d, size);
    if (Bits(misses) == 0xff) return AllInt(0);
    *span = Ball(o, d, size);
    return ~misses;
  }
  if (solid.kind == FacetSolid::Kind::kBox) {
    *span = Both(Slab(o.z, d.z, size), Both(Slab(o.x, d.x, size), Slab(o.y, d.y, size)));
    return span->enter <= span->leave;
  }
  const V moment = Fms(o.x, d.y, o.y * d.x), across = d.x * d.x + d.y * d.y;
  const VI meets = moment * moment <= size * size * across;
  if (Bits(meets) == 0) return meets;
  const Span slab = Slab(o.z, d.z, size);
  const Span round = Ball({o.x, o.y, All(0)}, {d.x, d.y, All(0)}, size);
  *span = Both(slab, round);
  *cap = slab.enter >= round.enter;
  return meets & (span->enter <= span->leave);
}

Choice Choose(const FacetSolid& solid, const Lanes& unit, V size, const V3& p, VI cap) {
  if (solid.kind == FacetSolid::Kind::kBox) return BoxChoice(unit, size);
  if (solid.kind == FacetSolid::Kind::kCylinder) return CylinderChoice(solid, p, cap);
  return EllipsoidChoice(solid, p);
}

/// The facet through which each ray enters a convex solid: guessed on a smooth body around it, and
/// from then on where the ray meets the plane of the last guess.
void CrossSolid(const FacetWorld& world, const FacetSolid& solid, VI active, Lanes* ray) {
  const Lanes unit = UnitRays(solid, *ray);
  const V size = 1.001f + 1e-6f * (Abs(unit.o.x) + Abs(unit.o.y) + Abs(unit.o.z));
  Span span = {};
  VI cap = AllInt(0), todo = active & Within(solid, unit, size, &span, &cap);
  if (Bits(todo) == 0) return;
  todo &= (span.leave >= 0.0f) & (span.enter <= ray->t);
  ray->unsure |= todo & (span.enter <= 0.0f);
  todo &= ~ray->unsure;
  VI last = AllInt(-1), half = last;
  V3 p = Along(unit.o, span.enter, unit.d);
  for (int i = 0; i < kRounds && Bits(todo) != 0; ++i) {
    Choice choice = Choose(solid, unit, size, p, cap);
    choice.half = Pick(choice.quad == last, half ^ 1, choice.half);
    last = choice.quad, half = choice.half;
    const Corners corners = CornersOf(solid, choice);
    V3 v[3];
    for (int k = 0; k < 3; ++k)
      v[k] = Vertices(world.vertices + solid.first, Pick(todo, corners.v[k], AllInt(0)));
    const Triangle triangle = TriangleOf(v[0], v[1], v[2]);
    const Crossing x = Cross(*ray, triangle);
    const VI found = todo & x.Inside(kEdge) & (x.den < 0.0f);
    Keep(x, triangle.n, found, AllInt(static_cast<int>(solid.material)), ray);
    todo &= ~found;
    p = Along(unit.o, x.depth / x.volume, unit.d);
  }
  ray->unsure |= todo;
}

Lanes LanesOf(const RayPacket& rays) {
  Lanes ray = {};
  ray.o = {Load(rays.ox), Load(rays.oy), Load(rays.oz)};
  ray.d = {Load(rays.dx), Load(rays.dy), Load(rays.dz)};
  ray.t = All(INFINITY);
  return ray;
}

/// One packet, whose solids are in the row.
unsigned TracePacket(const FacetWorld& world, const RayPacket& rays, const Row& row, float longest,
                     HitPacket* hits) {
  Lanes ray = LanesOf(rays);
  const VI used = kLane < rays.count;
  for (int i = 0; i < row.count; ++i) {
    const VI open = used & ~ray.unsure & (ray.t * longest >= row.distance[i]);
    if (Bits(open) == 0) break;
    CrossSolid(world, world.solids[row.solid[i]], open, &ray);
  }
  CrossGround(world.ground, used & ~ray.unsure, &ray);
  memcpy(hits->distance, &ray.t, sizeof ray.t);
  memcpy(hits->nx, &ray.n.x, sizeof ray.n.x);
  memcpy(hits->ny, &ray.n.y, sizeof ray.n.y);
  memcpy(hits->nz, &ray.n.z, sizeof ray.n.z);
  memcpy(hits->material, &ray.material, sizeof ray.material);
  return Bits(ray.unsure & used);
}

}  // namespace

void TraceFacets(const FacetWorld& world, const RayPacket* rays, int n, HitPacket* hits,
                 unsigned* unsure) {
  Near near;
  Collect(world, FanOf(rays, n), &near);
  for (int first = 0; first < n; first += kRowPackets) {
    const int end = first + kRowPackets < n ? first + kRowPackets : n;
    const Fan fan = FanOf(rays + first, end - first);
    Row row;
    Sort(near, fan, &row);
    for (int k = first; k < end; ++k)
      unsure[k] = near.full ? (1u << rays[k].count) - 1u
                            : TracePacket(world, rays[k], row, fan.longest, &hits[k]);
  }
}

}  // namespace chase::simulator

#else

namespace chase::simulator {

void TraceFacets(const FacetWorld&, const RayPacket* rays, int n, HitPacket*, unsigned* unsure) {
  for (int k = 0; k < n; ++k) unsure[k] = (1u << rays[k].count) - 1u;
}

}  // namespace chase::simulator

#endif
