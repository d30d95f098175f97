// Compiled with -mavx2 where the compiler knows it (see CMakeLists.txt); nothing here runs before
// the processor was asked.
#ifdef __AVX2__
#define CHASE_KERNELS_NAME "avx2"
#include "services/planning/fast_kernels.inc"

namespace chase::planning::kernels {
const Table* Avx2Kernels() { return __builtin_cpu_supports("avx2") ? &kTable : nullptr; }
}  // namespace chase::planning::kernels

#else
#include "services/planning/fast_kernels.h"

namespace chase::planning::kernels {
const Table* Avx2Kernels() { return nullptr; }
}  // namespace chase::planning::kernels
#endif
