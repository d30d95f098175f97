#define CHASE_KERNELS_NAME "portable"
#include "services/planning/fast_kernels.inc"

namespace chase::planning::kernels {

const Table& PortableKernels() { return kTable; }

const Table& Kernels() {
  const Table* avx2 = Avx2Kernels();
  return avx2 != nullptr ? *avx2 : kTable;
}

}  // namespace chase::planning::kernels
