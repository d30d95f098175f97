#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace chase::lidar {

/// A data packet as it came in.
struct RawPacket {
  std::vector<uint8_t> bytes;
  int64_t capture_utime = 0;  ///< arrival, microseconds since 1970 as the kernel or the capture
                              ///< says; 0: not known
};

/// Where data packets come from; position packets are left out.
class PacketSource {
 public:
  virtual ~PacketSource() = default;
  /// The next packet, or nothing for now (a device) or for good (a file).
  virtual std::optional<RawPacket> Next() = 0;
  /// True for a recording, which is to be played at its own pace.
  virtual bool IsRecording() const = 0;
};

/// `source` is "udp" (listens on `port`), a capture (classic pcap, whatever its name) or a file of
/// raw packets. Throws std::runtime_error with one line that says what, where and how to mend it.
std::unique_ptr<PacketSource> OpenPacketSource(const std::string& source, int port);

}  // namespace chase::lidar
