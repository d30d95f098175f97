// One LCM message of any type: what a process decodes, and what the log tools and the viewer do.
#include <cmath>
#include <memory>

#include "common/bus/message_head.h"
#include "common/logs/foxglove.h"
#include "common/logs/message_types.h"
#include "logs/src/message_fields.h"
#include "test/fuzz/target.h"
#include "test/fuzz/wire_bus.h"

namespace {

using namespace chase;  // NOLINT(google-build-using-namespace)

/// Has every type subscribed on a channel of its own: the type's name.
struct Listener {
  Listener() { SubscribeAll(static_cast<const logs::MessageTypes*>(nullptr)); }

  template <class... T>
  void SubscribeAll(const std::tuple<T...>*) {
    (bus.Subscribe<T>(T::getTypeName(), [this](const T&) { ++heard; }), ...);
  }

  fuzz::WireBus bus;
  int64_t heard = 0;
};

/// What decodes is written again as it was, byte for byte.
void RequireSameAgain(const logs::Bytes& bytes) {
  logs::WithMessage(bytes, [&](const auto& message) {
    logs::Bytes again(static_cast<size_t>(message.getEncodedSize()));
    message.encode(again.data(), 0, static_cast<int>(again.size()));
    fuzz::Require(again == bytes, "a message that decodes is written again as it was");
  });
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  static Listener listener;
  const logs::Bytes bytes(data, data + size);
  const std::string type = logs::TypeOf(bytes);
  listener.bus.Deliver(type, data, size);
  bus::HeadOf(data, size);
  logs::FieldsOf(bytes);
  RequireSameAgain(bytes);
  logs::ToViewer({0, fuzz::ChannelOf(type), bytes}, {});
  return 0;
}
