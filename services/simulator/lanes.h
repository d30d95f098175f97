#pragma once

// Eight lanes of AVX2, for files compiled for it; all of it internal to the file that includes it.
#include <immintrin.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#include "services/simulator/facets.h"

namespace chase::simulator {
namespace {

constexpr float kLeastEdge = 1e-6f;  // share of a triangle at its edges, more than it rounds
constexpr float kRounding = 5e-7f;   // eight roundings of a product, of single precision

typedef float V __attribute__((vector_size(32)));
typedef int32_t VI __attribute__((vector_size(32)));

inline V Load(const float* p) { return (V)_mm256_load_ps(p); }
inline V All(float x) { return (V)_mm256_set1_ps(x); }
inline VI AllInt(int x) { return (VI)_mm256_set1_epi32(x); }
inline V Max(V a, V b) { return (V)_mm256_max_ps((__m256)a, (__m256)b); }
inline V Min(V a, V b) { return (V)_mm256_min_ps((__m256)a, (__m256)b); }
inline V Sqrt(V a) { return (V)_mm256_sqrt_ps((__m256)a); }
inline V Fma(V a, V b, V c) { return (V)_mm256_fmadd_ps((__m256)a, (__m256)b, (__m256)c); }
inline V Fms(V a, V b, V c) { return (V)_mm256_fmsub_ps((__m256)a, (__m256)b, (__m256)c); }
inline V Floor(V a) { return (V)_mm256_floor_ps((__m256)a); }
inline V Abs(V a) { return (V)((VI)a & 0x7fffffff); }
inline V Sign(V a) { return (V)((VI)a & (int32_t)0x80000000); }
inline V Xor(V a, V b) { return (V)((VI)a ^ (VI)b); }
inline VI Whole(V a) { return (VI)_mm256_cvttps_epi32((__m256)a); }
inline V Real(VI a) { return (V)_mm256_cvtepi32_ps((__m256i)a); }
inline V Pick(VI mask, V a, V b) { return (V)_mm256_blendv_ps((__m256)b, (__m256)a, (__m256)mask); }
inline VI Pick(VI mask, VI a, VI b) { return (VI)Pick(mask, (V)a, (V)b); }
inline unsigned Bits(VI mask) { return (unsigned)_mm256_movemask_ps((__m256)mask); }
inline V Gather(const float* base, VI index) {
  return (V)_mm256_i32gather_ps(base, (__m256i)index, 4);
}

struct V3 {
  V x, y, z;
};

/// Columns of the eight rows of four that `row(lane)` loads. Quicker than gathers.
template <class Row>
__attribute__((always_inline)) inline void Transpose(const Row& row, V* columns) {
  __m256 r[4];
  for (int i = 0; i < 4; ++i) r[i] = _mm256_set_m128(row(i + 4), row(i));
  const __m256 a = _mm256_unpacklo_ps(r[0], r[1]), b = _mm256_unpackhi_ps(r[0], r[1]);
  const __m256 c = _mm256_unpacklo_ps(r[2], r[3]), d = _mm256_unpackhi_ps(r[2], r[3]);
  columns[0] = (V)_mm256_shuffle_ps(a, c, 0x44), columns[1] = (V)_mm256_shuffle_ps(a, c, 0xee);
  columns[2] = (V)_mm256_shuffle_ps(b, d, 0x44), columns[3] = (V)_mm256_shuffle_ps(b, d, 0xee);
}
/// Two neighbours each from two arrays.
inline __m128 Pairs(const float* a, const float* b) {
  return _mm_loadh_pi(_mm_castpd_ps(_mm_load_sd((const double*)a)), (const __m64*)b);
}

inline V3 operator-(const V3& a, const V3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline V3 Along(const V3& o, V t, const V3& d) {
  return {Fma(t, d.x, o.x), Fma(t, d.y, o.y), Fma(t, d.z, o.z)};
}
inline V Dot(const V3& a, const V3& b) { return Fma(a.x, b.x, Fma(a.y, b.y, a.z * b.z)); }
inline V3 Cross(const V3& a, const V3& b) {
  return {Fms(a.y, b.z, a.z * b.y), Fms(a.z, b.x, a.x * b.z), Fms(a.x, b.y, a.y * b.x)};
}

/// One Newton step on the processor's estimate, as in Embree 3's vfloat8.
inline V Reciprocal(V a) {
  const V r = (V)_mm256_rcp_ps((__m256)a);
  return Fma(r, (V)_mm256_fnmadd_ps((__m256)a, (__m256)r, _mm256_set1_ps(1.0f)), r);
}

/// Eight rays and the nearest hits found for them so far.
struct Lanes {
  V3 o, d;
  V t;  // of the nearest hit
  V3 n;
  VI material;
  VI unsure;
};

/// A triangle in each lane.
struct Triangle {
  V3 v0, e1, e2, n;
};

inline Triangle TriangleOf(const V3& v0, const V3& v1, const V3& v2) {
  Triangle triangle = {v0, v0 - v1, v2 - v0, {}};
  triangle.n = Cross(triangle.e2, triangle.e1);
  return triangle;
}

/// Möller and Trumbore 1997 as Embree 3 rounds it (triangle_intersector_moeller.h). All but t and
/// den in multiples of the volume |den|.
struct Crossing {
  V u, v, w, depth, volume, den;

  /// Inside the triangle by a volume, or, where it is below zero, not outside by more.
  VI Inside(V edge) const { return Min(Min(u, v), w) > edge; }
};

inline Crossing Cross(const Lanes& ray, const Triangle& triangle) {
  const V3 c = triangle.v0 - ray.o, r = Cross(c, ray.d);
  Crossing x;
  x.den = Dot(triangle.n, ray.d);
  x.volume = Abs(x.den);
  const V sign = Sign(x.den);
  x.u = Xor(Dot(triangle.e2, r), sign);
  x.v = Xor(Dot(triangle.e1, r), sign);
  x.w = x.volume - x.u - x.v;
  x.depth = Xor(Dot(triangle.n, c), sign);
  return x;
}

inline V Sum(const V3& a) { return Abs(a.x) + Abs(a.y) + Abs(a.z); }

/// How near to a triangle's edges a hit is not settled, in the unit of the crossing's volume: what
/// rounding may make of the way to the triangle times its edges, and a little more.
inline V EdgeMargin(const Crossing& x, float most, V edges_by_way) {
  return Min(most * x.volume, kLeastEdge * x.volume + kRounding * edges_by_way);
}

/// Keeps the crossing in the lanes where it is the nearest in front. Of two at the same distance
/// Embree takes one by the order of its search.
inline void Keep(const Crossing& x, const V3& n, VI lanes, VI material, Lanes* ray) {
  const V t = x.depth * Reciprocal(x.volume);
  ray->unsure |= lanes & (Abs(t - ray->t) <= 1e-6f * t);
  const VI nearer = lanes & (x.depth > 0.0f) & (t < ray->t);
  ray->t = Pick(nearer, t, ray->t);
  ray->n = {Pick(nearer, n.x, ray->n.x), Pick(nearer, n.y, ray->n.y), Pick(nearer, n.z, ray->n.z)};
  ray->material = Pick(nearer, material, ray->material);
}

}  // namespace
}  // namespace chase::simulator
