#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace chase::fcu {

/// Bytes as they came in. `age`: microseconds since they arrived.
struct Arrival {
  std::vector<uint8_t> bytes;
  int64_t age = 0;
};

/// The wire to the autopilot. A thread of its own reads, so that the time of arrival is that of the
/// bytes and not of whoever comes to fetch them.
class Transport {
 public:
  virtual ~Transport() = default;
  /// What has come in since the last call, in order.
  virtual std::vector<Arrival> Take() = 0;
  /// Sends one frame; what finds no room or no peer is dropped.
  virtual void Send(const std::vector<uint8_t>& bytes) = 0;
  /// The peer of what was taken last speaks MAVLink: answer there.
  virtual void Trust() = 0;
  /// Does an arrival hold whole frames?
  virtual bool whole() const = 0;
  /// "UDP port 14540", for messages.
  virtual std::string Name() const = 0;
  /// Why it carries nothing any more (a device that was pulled out); empty: it works.
  virtual std::string Problem() const = 0;
};

/// `link` is "udp" (listens on `port`, answers the last sender that was trusted) or a serial device
/// at `baud`. Throws std::runtime_error with one line that says what, where and how to mend it.
std::unique_ptr<Transport> OpenTransport(const std::string& link, int port, int baud);

}  // namespace chase::fcu
