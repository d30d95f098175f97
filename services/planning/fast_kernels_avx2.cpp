// Compiled with -mavx2 -mfma where the compiler knows them (see CMakeLists.txt); nothing here runs
// before the processor was asked.
#if defined(__AVX2__) && defined(__FMA__)
#define CHASE_LANES 8
#define CHASE_KERNELS_NAME "avx2"
#include "services/planning/fast_kernels.inc"

namespace chase::planning::kernels {
const Table* Avx2Kernels() {
  return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") ? &kTable : nullptr;
}
}  // namespace chase::planning::kernels

#else
#include "services/planning/fast_kernels.h"

namespace chase::planning::kernels {
const Table* Avx2Kernels() { return nullptr; }
}  // namespace chase::planning::kernels
#endif
