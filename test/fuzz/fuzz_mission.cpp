// Commands, and all else that the mission process hears. Records of: ticks until then (1 byte),
// length (2 bytes, low first), a message.
#include <algorithm>

#include "logs/src/message_fields.h"
#include "services/mission/mission_node.h"
#include "test/fuzz/target.h"
#include "test/fuzz/wire_bus.h"

namespace {

/// Of the channels with a flight's state it hears control's alone.
std::string ChannelOf(const std::string& type) {
  return type == "flight_state_t" ? "HOME" : chase::fuzz::ChannelOf(type);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace chase;                         // NOLINT(google-build-using-namespace)
  constexpr int64_t kStart = 1'000'000'000'000;  // us
  constexpr size_t kHead = 3;
  fuzz::WireBus bus;
  bus.SetIdentity({"mission", "", kStart});
  bus.now = kStart;
  mission::MissionConfig config;
  config.geofence.polygon = {{-9, -9}, {9, -9}, {9, 9}, {-9, 9}};
  mission::MissionNode node(bus, config);
  while (size >= kHead) {
    for (int tick = data[0] % 16; tick > 0; --tick) node.Tick(bus.now += node.TickPeriod());
    const size_t length = std::min(size - kHead, data[1] + size_t{256} * data[2]);
    data += kHead;
    bus.Deliver(ChannelOf(logs::TypeOf({data, data + length})), data, length);
    data += length;
    size -= kHead + length;
  }
  node.Tick(bus.now += node.TickPeriod());
  node.Report();
  return 0;
}
