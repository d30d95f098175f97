// Compiled for AVX2 and FMA on x86, like shading.cpp, and plain as it is.
#include "services/simulator/facets.h"

#ifdef __AVX2__

#include "services/simulator/fan.h"
#include "services/simulator/ground_tracer.h"
#include "services/simulator/lanes.h"

namespace chase::simulator {
namespace {

constexpr float kFacetEdge = 2e-4f;  // as kCellEdge
constexpr float kPi = 3.14159265f;
constexpr int kRounds = 4;               // of the search for the facet
constexpr float kUnitRounding = 1e-6f;   // of coordinates in half sizes
constexpr float kPlaneRounding = 1e-6f;  // sixteen roundings of a product
constexpr int kRowPackets = 4;           // of a tile, with one list of solids

#define CHASE_INLINE __attribute__((always_inline)) inline

/// atan(y / x) over the whole turn, to 1e-5. Abramowitz and Stegun 1964, 4.4.49.
CHASE_INLINE V Angle(V y, V x) {
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
CHASE_INLINE Lanes UnitRays(const FacetSolid& solid, const Lanes& ray) {
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

CHASE_INLINE Span Slab(V o, V d, V half) {
  const V rate = 1.0f / Pick(Abs(d) > 1e-12f, d, All(1e-12f));
  const V a = (-half - o) * rate, b = (half - o) * rate;
  return {Min(a, b), Max(a, b)};
}

/// Rays that miss the ball of a radius around the origin. By the cross product, as the discriminant
/// cancels far away.
CHASE_INLINE VI Misses(const V3& o, const V3& d, V radius) {
  const V3 moment = Cross(o, d);
  return Dot(moment, moment) > radius * radius * Dot(d, d);
}

CHASE_INLINE Span Ball(const V3& o, const V3& d, V radius) {
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
CHASE_INLINE void Column(const FacetSolid& solid, const V3& p, VI* column, V* share) {
  const float n = static_cast<float>(solid.around);
  V turn = Angle(p.y, p.x) * (0.5f / kPi);
  turn = n * (turn - Floor(turn));
  const V whole = Min(Floor(turn), All(n - 1.0f));
  *column = Whole(whole), *share = turn - whole;
}

/// The face that the point is beyond, or nearest to.
CHASE_INLINE Choice BoxChoice(const V3& p) {
  const V x = Abs(p.x), y = Abs(p.y), z = Abs(p.z);
  const VI on_z = (z >= x) & (z >= y), on_y = (y >= x) & ~on_z;
  const auto of = [&](V if_z, V if_y, V if_x) { return Pick(on_z, if_z, Pick(on_y, if_y, if_x)); };
  const VI positive = of(p.z, p.y, p.x) > 0.0f;
  const V a = of(p.x, p.z, p.y), b = of(p.y, p.x, p.z);
  const VI face = Pick(on_z, AllInt(0), Pick(on_y, AllInt(2), AllInt(4)));
  return {face - positive, Pick(positive, a <= b, b <= a) & 1};
}

/// The quads of the side, and after them the caps: below and above.
CHASE_INLINE Choice CylinderChoice(const FacetSolid& solid, const V3& p, VI cap) {
  VI column;
  V share;
  Column(solid, p, &column, &share);
  const VI side_half = (share < 0.5f * (p.z + 1.0f)) & 1;
  return {Pick(cap, solid.around + column, column), Pick(cap, (p.z > 0.0f) & 1, side_half)};
}

/// By the point's direction from the centre, along which the quads' edges are straight.
CHASE_INLINE Choice EllipsoidChoice(const FacetSolid& solid, const V3& p) {
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
CHASE_INLINE Corners BoxCorners(const Choice& choice) {
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
CHASE_INLINE Corners QuadCorners(const FacetSolid& solid, const Choice& choice, VI row) {
  const int n = solid.around;
  const VI a = choice.quad, column = a - row * n;
  const VI b = Pick(column == n - 1, a - column, a + 1), upper = choice.half != 0;
  return {{a, Pick(upper, b + n, b), Pick(upper, a + n, b + n)}};
}

CHASE_INLINE Corners CylinderCorners(const FacetSolid& solid, const Choice& choice) {
  const int n = solid.around;
  const VI cap = choice.quad >= n, top = choice.half != 0;
  const VI i = Pick(cap, choice.quad - n, choice.quad), next = Pick(i == n - 1, AllInt(0), i + 1);
  const Corners side = QuadCorners(solid, {i, choice.half}, AllInt(0));
  return {{Pick(cap, 2 * n + choice.half, side.v[0]), Pick(cap, Pick(top, n + i, next), side.v[1]),
           Pick(cap, Pick(top, n + next, i), side.v[2])}};
}

CHASE_INLINE Corners CornersOf(const FacetSolid& solid, const Choice& choice) {
  if (solid.kind == FacetSolid::Kind::kBox) return BoxCorners(choice);
  if (solid.kind == FacetSolid::Kind::kCylinder) return CylinderCorners(solid, choice);
  const V row = Floor((Real(choice.quad) + 0.5f) / static_cast<float>(solid.around));
  return QuadCorners(solid, choice, Whole(row));
}

/// A vertex for each lane.
CHASE_INLINE V3 Vertices(const FacetVertex* base, VI index) {
  int at[8];
  memcpy(at, &index, sizeof at);
  V columns[4];
  Transpose([&](int lane) { return _mm_load_ps(base[at[lane]].p); }, columns);
  return {columns[0], columns[1], columns[2]};
}

/// Where the rays may be within the solid: a span of a body slightly larger, and, of a cylinder,
/// the lanes that seem to enter it by a cap.
CHASE_INLINE VI Within(const FacetSolid& solid, const Lanes& unit, V size, Span* span, VI* cap) {
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

CHASE_INLINE Choice Choose(const FacetSolid& solid, const V3& p, VI cap) {
  if (solid.kind == FacetSolid::Kind::kBox) return BoxChoice(p);
  if (solid.kind == FacetSolid::Kind::kCylinder) return CylinderChoice(solid, p, cap);
  return EllipsoidChoice(solid, p);
}

/// Where the rays are behind the planes of the facets tried so far (Cyrus and Beck 1978): a ray
/// that leaves by one before it enters by another passes the solid by, between the facets and the
/// smooth body around them. Both ends count by what rounding may make of them.
struct Clip {
  V enter = All(-INFINITY), leave = All(INFINITY);

  VI Missed(const Triangle& triangle, const Crossing& x, V t, V way) {
    const V slack = kPlaneRounding * Products(triangle.e1, triangle.e2) * way / x.volume;
    enter = Pick(x.den < 0.0f, Max(enter, t - slack), enter);
    leave = Pick(x.den > 0.0f, Min(leave, t + slack), leave);
    return enter > leave;
  }
  /// Of all that the cross product is the sum of.
  static V Products(const V3& a, const V3& b) {
    return Abs(a.x) * (Abs(b.y) + Abs(b.z)) + Abs(a.y) * (Abs(b.z) + Abs(b.x)) +
           Abs(a.z) * (Abs(b.x) + Abs(b.y));
  }
};

/// The facet through which each ray enters a convex solid: guessed on a smooth body around it, and
/// from then on where the ray meets the plane of the last guess. A cylinder's cap is tried in vain
/// once; the next guess is then the side.
CHASE_INLINE void CrossSolid(const FacetWorld& world, const FacetSolid& solid, VI active,
                             Lanes* ray) {
  const Lanes unit = UnitRays(solid, *ray);
  const V size = 1.001f + kUnitRounding * (Abs(unit.o.x) + Abs(unit.o.y) + Abs(unit.o.z));
  Span span = {};
  VI cap = AllInt(0), todo = active & Within(solid, unit, size, &span, &cap);
  if (Bits(todo) == 0) return;
  todo &= (span.leave >= 0.0f) & (span.enter <= ray->t);
  ray->unsure |= todo & (span.enter <= 0.0f);
  todo &= ~ray->unsure;
  Clip clip;
  VI last = AllInt(-1), half = last;
  V3 p = Along(unit.o, span.enter, unit.d);
  for (int i = 0; i < kRounds && Bits(todo) != 0; ++i) {
    Choice choice = Choose(solid, p, cap);
    choice.half = Pick(choice.quad == last, half ^ 1, choice.half);
    last = choice.quad, half = choice.half;
    const Corners corners = CornersOf(solid, choice);
    V3 v[3];
    for (int k = 0; k < 3; ++k)
      v[k] = Vertices(world.vertices + solid.first, Pick(todo, corners.v[k], AllInt(0)));
    const Triangle triangle = TriangleOf(v[0], v[1], v[2]);
    const Crossing x = Cross(*ray, triangle);
    const V edges = Sum(triangle.e1) + Sum(triangle.e2), way = Sum(triangle.v0 - ray->o);
    const VI found = todo & x.Inside(EdgeMargin(x, kFacetEdge, edges * way)) & (x.den < 0.0f);
    Keep(x, triangle.n, found, AllInt(static_cast<int>(solid.material)), ray);
    const V t = x.depth / x.volume;
    todo &= ~(found | clip.Missed(triangle, x, t, way));
    p = Along(unit.o, t, unit.d);
    cap = (Abs(p.z) > 1.0f) & ~cap;
  }
  ray->unsure |= todo;
}

CHASE_INLINE Lanes LanesOf(const RayPacket& rays) {
  Lanes ray = {};
  ray.o = {Load(rays.ox), Load(rays.oy), Load(rays.oz)};
  ray.d = {Load(rays.dx), Load(rays.dy), Load(rays.dz)};
  ray.t = All(INFINITY);
  return ray;
}

CHASE_INLINE void Store(const Lanes& ray, HitPacket* hits) {
  memcpy(hits->distance, &ray.t, sizeof ray.t);
  memcpy(hits->nx, &ray.n.x, sizeof ray.n.x);
  memcpy(hits->ny, &ray.n.y, sizeof ray.n.y);
  memcpy(hits->nz, &ray.n.z, sizeof ray.n.z);
  memcpy(hits->material, &ray.material, sizeof ray.material);
}

CHASE_INLINE unsigned TraceBody(const FacetWorld& world, const RayPacket& rays,
                                const NearSolids& near, HitPacket* hits) {
  Lanes ray = LanesOf(rays);
  const VI used = kLane < rays.count;
  for (int i = 0; i < near.count; ++i) {
    const VI open = used & ~ray.unsure & (ray.t >= near.first[i].least);
    if (Bits(open) == 0) break;
    CrossSolid(world, world.solids[near.first[i].solid], open, &ray);
  }
  if (world.ground.columns > 0) CrossGround(world.ground, used & ~ray.unsure, &ray);
  Store(ray, hits);
  return Bits(ray.unsure & used);
}

/// As Embree 3 turns rays into the axes of an instance: the inverse of the turn by its determinant.
CHASE_INLINE Lanes RaysInAxes(const FacetPlace& place, const Lanes& ray) {
  const float det = place.cos_yaw * place.cos_yaw + place.sin_yaw * place.sin_yaw;
  const float c = place.cos_yaw / det, s = place.sin_yaw / det, *p = place.p;
  const V x = All(-(c * p[0] + s * p[1])), y = All(-(c * p[1] - s * p[0]));
  Lanes turned = ray;
  turned.o = {Fma(ray.o.x, All(c), Fma(ray.o.y, All(s), x)),
              Fma(ray.o.x, All(-s), Fma(ray.o.y, All(c), y)), ray.o.z - p[2]};
  turned.d = {Fma(ray.d.x, All(c), ray.d.y * s), Fma(ray.d.x, All(-s), ray.d.y * c), ray.d.z};
  return turned;
}

CHASE_INLINE void CrossMoving(const FacetWorld& shapes, int i, const FacetPlace& place, VI active,
                              Lanes* ray) {
  const Lanes before = *ray;
  *ray = RaysInAxes(place, before);
  CrossSolid(shapes, shapes.solids[i], active, ray);
  const float c = place.cos_yaw, s = place.sin_yaw;
  const VI hit = ray->t < before.t;
  const V x = c * ray->n.x - s * ray->n.y, y = s * ray->n.x + c * ray->n.y;
  ray->n.x = Pick(hit, x, before.n.x), ray->n.y = Pick(hit, y, before.n.y);
  ray->o = before.o, ray->d = before.d;
}

// One body, compiled for AVX2 and for the masks and the 32 registers of AVX-512: the same
// operations, lane by lane. The processor decides at run time.
unsigned TraceAvx2(const FacetWorld& world, const RayPacket& rays, const NearSolids& near,
                   HitPacket* hits) {
  return TraceBody(world, rays, near, hits);
}
__attribute__((target("avx512f,avx512vl,avx512dq,avx512bw"))) unsigned TraceAvx512(
    const FacetWorld& world, const RayPacket& rays, const NearSolids& near, HitPacket* hits) {
  return TraceBody(world, rays, near, hits);
}
const bool kHasAvx512 = __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512dq") &&
                        __builtin_cpu_supports("avx512bw");
const auto TracePacket = kHasAvx512 ? TraceAvx512 : TraceAvx2;

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
                            : TracePacket(world, rays[k], {row.solids, row.count}, &hits[k]);
  }
}

void TraceNear(const FacetWorld& world, const NearSolids& near, const RayPacket* rays, int n,
               HitPacket* hits, unsigned* unsure) {
  for (int k = 0; k < n; ++k) unsure[k] = TracePacket(world, rays[k], near, &hits[k]);
}

bool TraceMoving(const FacetWorld& shapes, const FacetPlace* places, int n, const RayPacket& rays,
                 HitPacket* hits) {
  Lanes ray = LanesOf(rays);
  ray.t = Load(hits->distance);
  ray.n = {Load(hits->nx), Load(hits->ny), Load(hits->nz)};
  memcpy(&ray.material, hits->material, sizeof ray.material);
  const VI used = kLane < rays.count;
  for (int i = 0; i < n; ++i) CrossMoving(shapes, i, places[i], used & ~ray.unsure, &ray);
  if (Bits(ray.unsure & used) != 0) return false;
  Store(ray, hits);
  return true;
}

bool MayMeet(const BoundsNode* boxes, int n_nodes, const RayPacket* rays, int n) {
  const Fan fan = FanOf(rays, n);
  V gap;
  for (int i = 0; i < n_nodes; ++i)
    if (Meets(boxes[i], fan, &gap) != 0) return true;
  return false;
}

}  // namespace chase::simulator

#else

namespace chase::simulator {

void TraceFacets(const FacetWorld&, const RayPacket* rays, int n, HitPacket*, unsigned* unsure) {
  for (int k = 0; k < n; ++k) unsure[k] = (1u << rays[k].count) - 1u;
}

void TraceNear(const FacetWorld& world, const NearSolids&, const RayPacket* rays, int n,
               HitPacket* hits, unsigned* unsure) {
  TraceFacets(world, rays, n, hits, unsure);
}

bool TraceMoving(const FacetWorld&, const FacetPlace*, int, const RayPacket&, HitPacket*) {
  return false;
}

bool MayMeet(const BoundsNode*, int, const RayPacket*, int) { return true; }

}  // namespace chase::simulator

#endif
