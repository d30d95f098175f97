// A capture file of UDP packets.
#include "services/lidar/pcap_reader.h"
#include "test/fuzz/target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace chase;  // NOLINT(google-build-using-namespace)
  const std::vector<uint8_t> bytes(data, data + size);
  if (!lidar::IsPcap(bytes)) return 0;
  fuzz::Accepts([&] { lidar::ReadPcap(bytes, "fuzz"); });
  return 0;
}
