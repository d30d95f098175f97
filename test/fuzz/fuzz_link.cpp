// Packets of the link, each behind its length in two bytes: what comes over the radio.
#include <algorithm>
#include <set>

#include "services/link/packet.h"
#include "test/fuzz/target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace chase;  // NOLINT(google-build-using-namespace)
  link::Unpacker unpacker;
  std::vector<link::Message> messages;
  for (size_t at = 0; at + 2 <= size;) {
    const size_t bytes = std::min<size_t>(size_t{data[at]} << 8 | data[at + 1], size - at - 2);
    unpacker.Take(data + at + 2, bytes, &messages);
    at += 2 + bytes;
  }
  for (const auto& m : messages) {
    fuzz::Require(!m.channel.empty() && m.channel.size() <= 64, "a channel has a name");
    fuzz::Require(m.bytes.size() <= size, "no message is made of nothing");
  }
  fuzz::Require(unpacker.lost() >= 0, "a count of what was lost");
  return 0;
}
