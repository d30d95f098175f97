// Bytes from the autopilot. The first says how they are cut into datagrams, and whether checksums
// are made right before, so that what is mutated is read and not only refused.
#include <algorithm>
#include <vector>

#include "services/fcu/bridge.h"
#include "test/fuzz/target.h"

namespace {

using namespace chase;  // NOLINT(google-build-using-namespace)

constexpr size_t kHead = 10, kChecksum = 2;  // bytes of MAVLink 2
constexpr uint8_t kMagic = 0xFD;

/// Gives every whole frame of a known message its checksum.
void RightChecksums(std::vector<uint8_t>* bytes) {
  for (size_t at = 0; at + kHead + kChecksum <= bytes->size();) {
    uint8_t* frame = bytes->data() + at;
    const size_t end = kHead + frame[1];
    const auto extra =
        mavlink::ChecksumExtra(frame[7] | uint32_t{frame[8]} << 8 | uint32_t{frame[9]} << 16);
    if (frame[0] != kMagic || at + end + kChecksum > bytes->size() || !extra) {
      ++at;
      continue;
    }
    const uint16_t sum = mavlink::FrameChecksum(frame + 1, end - 1, *extra);
    frame[end] = static_cast<uint8_t>(sum & 0xFF);
    frame[end + 1] = static_cast<uint8_t>(sum >> 8);
    at += end + kChecksum;
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  if (size == 0) return 0;
  const size_t piece = 1 + data[0] % 32 * 16;
  std::vector<uint8_t> bytes(data + 1, data + size);
  if (data[0] % 64 >= 32) RightChecksums(&bytes);
  mavlink::Signing signing(mavlink::Key{}, 1);
  mavlink::FrameReader sealed(&signing);
  fcu::Bridge bridge{fcu::FcuConfig{}};
  int64_t now = 1'800'000'000'000'000;  // us
  for (size_t at = 0; at < bytes.size(); at += piece) {
    const size_t part = std::min(bytes.size() - at, piece);
    now += 10'000;
    bridge.Receive(now, now, bytes.data() + at, part, data[0] >= 128);
    bridge.Tick(now);
    bridge.TakeOutgoing();
    bridge.TakeImu();
    sealed.Add(now, bytes.data() + at, part, [](const mavlink::Frame&) {});
  }
  fuzz::Require(!bridge.Words().empty(), "the bridge has something to say");
  return 0;
}
