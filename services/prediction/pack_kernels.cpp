#include "services/prediction/pack_kernels.h"

#include <algorithm>
#include <cmath>

// One body, compiled for the baseline and for AVX2; the processor decides at run time.
#if defined(__x86_64__) && defined(__GNUC__)
#define CHASE_HAS_AVX2_BUILD 1
#endif

namespace chase::prediction {
namespace {

#define CHASE_INLINE __attribute__((always_inline)) inline

// Eight lanes at any address; the compiler lowers them to what the target has.
typedef float Floats __attribute__((vector_size(32), aligned(4), may_alias));
typedef int Ints __attribute__((vector_size(32), aligned(4), may_alias));
constexpr int kPack = 8;
constexpr float kMargin = 1e-5F;

CHASE_INLINE Floats All(float x) { return Floats{} + x; }

// e^x for -80 <= x <= 80: 2^n e^r with |r| <= ln(2) / 2, the Taylor series of e^r to r^7. Relative
// error below 1e-6.
CHASE_INLINE Floats Exp(Floats x) {
  const Floats scaled = x * 1.44269504F;
  const Ints n = __builtin_convertvector(scaled + (scaled < 0.0F ? All(-0.5F) : All(0.5F)), Ints);
  const Floats whole = __builtin_convertvector(n, Floats);
  const Floats r = (x - whole * 0.693359375F) + whole * 2.12194440e-4F;
  Floats e = All(1.0F / 5040);
  e = e * r + 1.0F / 720;
  e = e * r + 1.0F / 120;
  e = e * r + 1.0F / 24;
  e = e * r + 1.0F / 6;
  e = e * r + 0.5F;
  e = e * r + 1.0F;
  e = e * r + 1.0F;
  const Ints power = (n + 127) << 23;
  return e * reinterpret_cast<const Floats&>(power);
}

// Lower bound of constant + (||origin + point|| - radius)^2.
CHASE_INLINE Floats Squares(const SquaresTerm& term, const float* table, const float* origin,
                            int pack) {
  Floats sum{};
  for (int d = 0; d < term.dims; ++d) {
    const Floats x =
        origin[d] + *reinterpret_cast<const Floats*>(table + d * kLanes + pack * kPack);
    sum += x * x;
  }
  float roots[kPack];
  *reinterpret_cast<Floats*>(roots) = sum;
  for (float& root : roots) root = std::sqrt(root);
  Floats norm = *reinterpret_cast<const Floats*>(roots) - term.radius;
  norm = norm > 0.0F ? norm : All(0.0F);
  const Floats squares = norm * norm;
  return (term.constant + squares) - kMargin * (std::abs(term.constant) + squares);
}

CHASE_INLINE void CostBoundsBody(const SquaresTerm& sum, const SquaresTerm& exponent,
                                 const float* table, const float* origin, uint32_t wanted,
                                 float* out) {
  for (int pack = 0; pack < kLanes / kPack; ++pack) {
    if ((wanted >> (pack * kPack) & 0xFFU) == 0) continue;
    const Floats a = Squares(sum, table, origin, pack);
    const Floats x = Squares(exponent, table + sum.dims * kLanes, origin + sum.dims, pack);
    const Floats high = x < 80.0F ? x : All(80.0F);
    const Floats held = high > -80.0F ? high : All(-80.0F);
    const Floats e = x < -80.0F ? All(0.0F) : Exp(held) * (1.0F - kMargin);
    *reinterpret_cast<Floats*>(out + pack * kPack) = a + e;
  }
}

CHASE_INLINE uint32_t InsideBody(const float* table, const float* origin, uint32_t wanted,
                                 float limit) {
  Ints bits{};
  const Ints lane = {1, 2, 4, 8, 16, 32, 64, 128};
  for (int pack = 0; pack < kLanes / kPack; ++pack) {
    if ((wanted >> (pack * kPack) & 0xFFU) == 0) continue;
    const Floats* t = reinterpret_cast<const Floats*>(table + pack * kPack);
    const Floats x = origin[0] + t[0], y = origin[1] + t[kLanes / kPack],
                 z = origin[2] + t[2 * kLanes / kPack];
    bits |= ((x * x + y * y + z * z) < limit) & (lane << (pack * kPack));
  }
  uint32_t all = 0;
  for (int l = 0; l < kPack; ++l) all |= static_cast<uint32_t>(bits[l]);
  return all & wanted;
}

void CostBoundsBaseline(const SquaresTerm& sum, const SquaresTerm& exponent, const float* table,
                        const float* origin, uint32_t wanted, float* out) {
  CostBoundsBody(sum, exponent, table, origin, wanted, out);
}
uint32_t InsideBaseline(const float* table, const float* origin, uint32_t wanted, float limit) {
  return InsideBody(table, origin, wanted, limit);
}
constexpr Kernels kBaseline = {CostBoundsBaseline, InsideBaseline};

#ifdef CHASE_HAS_AVX2_BUILD
__attribute__((target("avx2"))) void CostBoundsAvx2(const SquaresTerm& sum,
                                                    const SquaresTerm& exponent, const float* table,
                                                    const float* origin, uint32_t wanted,
                                                    float* out) {
  CostBoundsBody(sum, exponent, table, origin, wanted, out);
}
__attribute__((target("avx2"))) uint32_t InsideAvx2(const float* table, const float* origin,
                                                    uint32_t wanted, float limit) {
  return InsideBody(table, origin, wanted, limit);
}
constexpr Kernels kAvx2 = {CostBoundsAvx2, InsideAvx2};
#endif

}  // namespace

const Kernels& BaselineKernels() { return kBaseline; }

const Kernels& BestKernels() {
#ifdef CHASE_HAS_AVX2_BUILD
  static const bool kHasAvx2 = __builtin_cpu_supports("avx2");
  if (kHasAvx2) return kAvx2;
#endif
  return kBaseline;
}

}  // namespace chase::prediction
