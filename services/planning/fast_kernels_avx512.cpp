// Compiled with -mavx512f and its companions where the compiler knows them (see CMakeLists.txt);
// nothing here runs before the processor was asked.
#ifdef __AVX512F__
#define CHASE_LANES 16
#define CHASE_KERNELS_NAME "avx512"
#include "services/planning/fast_kernels.inc"

namespace chase::planning::kernels {
const Table* Avx512Kernels() {
  return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
                 __builtin_cpu_supports("avx512vl")
             ? &kTable
             : nullptr;
}
}  // namespace chase::planning::kernels

#else
#include "services/planning/fast_kernels.h"

namespace chase::planning::kernels {
const Table* Avx512Kernels() { return nullptr; }
}  // namespace chase::planning::kernels
#endif
