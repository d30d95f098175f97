#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace chase::fcu {

/// Bytes as they came in.
struct Arrival {
  std::vector<uint8_t> bytes;
  int64_t age = 0;    ///< microseconds since they arrived
  uint64_t peer = 0;  ///< who sent a datagram; 0 on a wire with one other end
};

/// The wire to the autopilot. A thread of its own reads, so that the time of arrival is that of the
/// bytes and not of whoever comes to fetch them.
class Transport {
 public:
  virtual ~Transport() = default;
  /// What has come in since the last call, in order.
  virtual std::vector<Arrival> Take() = 0;
  /// Sends one frame to a peer; what finds no room or no peer is dropped.
  virtual void Send(const std::vector<uint8_t>& bytes, uint64_t peer) = 0;
  /// Frames to a peer that were not sent whole.
  virtual int64_t dropped() const = 0;
  /// Does an arrival hold whole frames?
  virtual bool whole() const = 0;
  /// "UDP port 14540", for messages.
  virtual std::string Name() const = 0;
  /// Why it carries nothing now (a device that was pulled out; it is opened again when it is back);
  /// empty: it works.
  virtual std::string Problem() const = 0;
};

/// `link` is "udp" (listens on `port`) or a serial device at `baud`. Throws std::runtime_error with
/// one line that says what, where and how to mend it.
std::unique_ptr<Transport> OpenTransport(const std::string& link, int port, int baud);

}  // namespace chase::fcu
