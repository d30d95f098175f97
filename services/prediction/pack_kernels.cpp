#include "services/prediction/pack_kernels.h"

#include <algorithm>
#include <cstring>
#include <limits>

// One body, compiled for the baseline and for AVX2; the processor decides at run time.
#if defined(__x86_64__) && defined(__GNUC__)
#define CHASE_HAS_AVX2_BUILD 1
#endif

namespace chase::prediction {
namespace {

#define CHASE_INLINE __attribute__((always_inline)) inline

CHASE_INLINE float AffineRowBody(const float* constant, const float* table, const float* factors,
                                 int dims, int blocks, float* out) {
  float least[kLanes];
  for (int l = 0; l < kLanes; ++l) least[l] = std::numeric_limits<float>::max();
  for (int block = 0; block < blocks; ++block) {
    float sum[kLanes];
    for (int l = 0; l < kLanes; ++l) sum[l] = constant[l];
    for (int d = 0; d < dims; ++d)
      for (int l = 0; l < kLanes; ++l) sum[l] += factors[d] * table[d * kLanes + l];
    for (int l = 0; l < kLanes; ++l) {
      out[l] = sum[l];
      least[l] = sum[l] < least[l] ? sum[l] : least[l];
    }
    constant += kLanes;
    table += static_cast<ptrdiff_t>(dims) * kLanes;
    out += kLanes;
  }
  return *std::min_element(least, least + kLanes);
}

CHASE_INLINE int MaskInsideBody(const float* points, const float origin[3], float limit, int blocks,
                                int* alive) {
  int left[kLanes] = {};
  for (int block = 0; block < blocks; ++block) {
    for (int l = 0; l < kLanes; ++l) {
      const float x = origin[0] + points[l], y = origin[1] + points[kLanes + l],
                  z = origin[2] + points[2 * kLanes + l];
      const int keep = (x * x + y * y + z * z) >= limit ? alive[l] : 0;
      left[l] += keep;
      alive[l] = keep;
    }
    points += 3 * kLanes;
    alive += kLanes;
  }
  int sum = 0;
  for (int l = 0; l < kLanes; ++l) sum += left[l];
  return sum;
}

#ifdef CHASE_HAS_AVX2_BUILD
__attribute__((target("avx2"))) float AffineRowAvx2(const float* constant, const float* table,
                                                    const float* factors, int dims, int blocks,
                                                    float* out) {
  return AffineRowBody(constant, table, factors, dims, blocks, out);
}
__attribute__((target("avx2"))) int MaskInsideAvx2(const float* points, const float origin[3],
                                                   float limit, int blocks, int* alive) {
  return MaskInsideBody(points, origin, limit, blocks, alive);
}
bool HasAvx2() {
  static const bool kHas = __builtin_cpu_supports("avx2");
  return kHas;
}
#endif

}  // namespace

float AffineRow(const float* constant, const float* table, const float* factors, int dims,
                int blocks, float* out) {
#ifdef CHASE_HAS_AVX2_BUILD
  if (HasAvx2()) return AffineRowAvx2(constant, table, factors, dims, blocks, out);
#endif
  return AffineRowBody(constant, table, factors, dims, blocks, out);
}

int MaskInside(const float* points, const float origin[3], float limit, int blocks, int* alive) {
#ifdef CHASE_HAS_AVX2_BUILD
  if (HasAvx2()) return MaskInsideAvx2(points, origin, limit, blocks, alive);
#endif
  return MaskInsideBody(points, origin, limit, blocks, alive);
}

}  // namespace chase::prediction
