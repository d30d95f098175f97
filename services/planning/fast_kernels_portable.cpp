#define CHASE_LANES 8
#define CHASE_KERNELS_NAME "portable"
#include "services/planning/fast_kernels.inc"

namespace chase::planning::kernels {

const Table& PortableKernels() { return kTable; }

const Table& Kernels() {
  if (const Table* avx512 = Avx512Kernels()) return *avx512;
  if (const Table* avx2 = Avx2Kernels()) return *avx2;
  return kTable;
}

}  // namespace chase::planning::kernels
