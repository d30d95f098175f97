#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <utility>
#include <vector>

#include "common/mavlink/payload.h"
#include "common/mavlink/signing.h"

/// Frames of MAVLink 1 and 2 (mavlink.io/en/guide/serialization.html).
namespace chase::mavlink {

/// One frame whose checksum holds, and its signature where the link is signed.
struct Frame {
  int version = 2;  ///< of the protocol: 1 or 2
  uint8_t sequence = 0, system = 0, component = 0;
  uint32_t id = 0;  ///< of the message
  Payload payload;
};

/// The message where the frame carries one of this type.
template <class M>
std::optional<M> As(const Frame& frame) {
  if (frame.id != M::kId) return std::nullopt;
  return FromPayload<M>(frame.payload);
}

/// Bytes to frames. Bytes may come in pieces of any size; what is no frame is passed over.
class FrameReader {
 public:
  using Taker = std::function<void(const Frame&)>;

  struct Counters {
    int64_t frames = 0;        ///< handed over
    int64_t unknown = 0;       ///< of no definition, left out by their length
    int64_t bad_checksum = 0;  ///< what began like a frame of a known message
    int64_t refused = 0;       ///< unsigned, forged, replayed or late
    int64_t late = 0;          ///< of those: by our key, but of a clock that lags
    int64_t lost = 0;          ///< by the gaps of all senders
  };

  /// With `signing` only signed frames are handed over; it has to outlive the reader.
  explicit FrameReader(Signing* signing = nullptr) : signing_(signing) {}

  void Add(int64_t utime, const uint8_t* data, std::size_t size, const Taker& take);
  /// Forgets an unfinished frame: the end of a datagram.
  void Reset() { buffer_.clear(); }

  const Counters& counters() const { return counters_; }
  /// Frames lost by (system, component).
  const std::map<std::pair<uint8_t, uint8_t>, int64_t>& lost() const { return lost_; }

 private:
  std::size_t TakeOne(int64_t utime, const uint8_t* data, std::size_t size, const Taker& take);
  bool IsGenuine(int64_t utime, const Frame& frame, const uint8_t* data, std::size_t size);
  void CountGap(const Frame& frame);

  Signing* signing_;
  std::vector<uint8_t> buffer_;
  Counters counters_;
  std::map<std::pair<uint8_t, uint8_t>, int64_t> lost_;
  std::map<std::pair<uint8_t, uint8_t>, uint8_t> last_;  // sequence
};

/// Messages to frames of MAVLink 2, numbered, zeros at the end cut.
class FrameWriter {
 public:
  FrameWriter(uint8_t system, uint8_t component, Signing* signing = nullptr)
      : system_(system), component_(component), signing_(signing) {}

  void SetSystem(uint8_t system) { system_ = system; }
  uint8_t system() const { return system_; }
  uint8_t component() const { return component_; }

  template <class M>
  std::vector<uint8_t> Write(int64_t utime, const M& message) {
    return Write(utime, M::kId, ToPayload(message));
  }

 private:
  std::vector<uint8_t> Write(int64_t utime, uint32_t id, const Payload& payload);

  uint8_t system_, component_;
  Signing* signing_;
  uint8_t sequence_ = 0;
};

/// CRC-16/MCRF4XX of the bytes, then of `extra`.
uint16_t FrameChecksum(const uint8_t* data, std::size_t size, uint8_t extra);
/// CRC_EXTRA of a message; none: no definition has this id.
std::optional<uint8_t> ChecksumExtra(uint32_t id);

}  // namespace chase::mavlink
