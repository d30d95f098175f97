#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace chase::bus {

/// What every message of ours begins with (lcmtypes/README.md).
struct MessageHead {
  struct Input {
    std::string channel;  ///< without the vehicle's prefix
    int32_t seq;
  };
  int64_t utime = 0;  ///< microseconds
  int32_t seq = 0;
  std::string sender, vehicle;
  int64_t sender_start = 0;   ///< microseconds
  std::vector<Input> inputs;  ///< what the sender had heard last of each channel
};

/// Reads it without knowing the message's type; nothing when the bytes do not begin like that.
std::optional<MessageHead> HeadOf(const void* data, size_t size);

}  // namespace chase::bus
