#include "services/prediction/pack_kernels.h"

#include <algorithm>
#include <limits>

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
constexpr int kPack = 8, kPacks = kLanes / kPack;

CHASE_INLINE float AffineRowBody(const float* constant, const float* table, const float* factors,
                                 int dims, int blocks, float* out) {
  Floats least = Floats{} + std::numeric_limits<float>::max();
  for (int block = 0; block < blocks; ++block) {
    const Floats* in = reinterpret_cast<const Floats*>(constant + block * kLanes);
    Floats sum[kPacks] = {in[0], in[1], in[2], in[3]};
    for (int d = 0; d < dims; ++d) {
      const Floats* t = reinterpret_cast<const Floats*>(table + (block * dims + d) * kLanes);
      for (int p = 0; p < kPacks; ++p) sum[p] += factors[d] * t[p];
    }
    for (int p = 0; p < kPacks; ++p) {
      reinterpret_cast<Floats*>(out + block * kLanes)[p] = sum[p];
      least = sum[p] < least ? sum[p] : least;
    }
  }
  float result = least[0];
  for (int l = 1; l < kPack; ++l) result = std::min(result, static_cast<float>(least[l]));
  return result;
}

CHASE_INLINE int Sum(const Ints& lanes) {
  int sum = 0;
  for (int l = 0; l < kPack; ++l) sum += lanes[l];
  return sum;
}

CHASE_INLINE int KeepBelowBody(const float* values, float limit, int blocks, int* alive) {
  Ints count = {};
  for (int p = 0; p < blocks * kPacks; ++p) {
    Ints& a = reinterpret_cast<Ints*>(alive)[p];
    a = (reinterpret_cast<const Floats*>(values)[p] < limit) & 1;
    count += a;
  }
  return Sum(count);
}

CHASE_INLINE int MaskInsideBody(const float* points, const float origin[3], float limit, int blocks,
                                int* alive) {
  Ints left = {};
  for (int block = 0; block < blocks; ++block) {
    const Floats* t = reinterpret_cast<const Floats*>(points + block * 3 * kLanes);
    Ints* a = reinterpret_cast<Ints*>(alive + block * kLanes);
    for (int p = 0; p < kPacks; ++p) {
      const Floats x = origin[0] + t[p], y = origin[1] + t[kPacks + p],
                   z = origin[2] + t[2 * kPacks + p];
      a[p] &= (x * x + y * y + z * z) >= limit;
      left += a[p];
    }
  }
  return Sum(left);
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
__attribute__((target("avx2"))) int KeepBelowAvx2(const float* values, float limit, int blocks,
                                                  int* alive) {
  return KeepBelowBody(values, limit, blocks, alive);
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

int KeepBelow(const float* values, float limit, int blocks, int* alive) {
#ifdef CHASE_HAS_AVX2_BUILD
  if (HasAvx2()) return KeepBelowAvx2(values, limit, blocks, alive);
#endif
  return KeepBelowBody(values, limit, blocks, alive);
}

int MaskInside(const float* points, const float origin[3], float limit, int blocks, int* alive) {
#ifdef CHASE_HAS_AVX2_BUILD
  if (HasAvx2()) return MaskInsideAvx2(points, origin, limit, blocks, alive);
#endif
  return MaskInsideBody(points, origin, limit, blocks, alive);
}

}  // namespace chase::prediction
