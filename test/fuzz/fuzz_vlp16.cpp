// A stream of VLP-16 packets: the sensor's own length each, what is left over comes last.
#include <algorithm>

#include "services/lidar/sweep_assembler.h"
#include "test/fuzz/target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace chase;  // NOLINT(google-build-using-namespace)
  lidar::SweepAssembler assembler{lidar::LidarConfig{}};
  for (size_t at = 0; at < size; at += lidar::kPacketBytes) {
    const size_t bytes = std::min(size - at, lidar::kPacketBytes);
    if (lidar::PacketProblem(data + at, bytes).empty()) lidar::Decode(data + at, 0.3, 130.0);
    for (const auto& sweep : assembler.Add(data + at, bytes))
      fuzz::Require(sweep.covered_deg >= 0.0, "a sweep covers an angle");
  }
  assembler.Finish();
  return 0;
}
