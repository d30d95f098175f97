#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/bus/message_head.h"

namespace chase::bus {

/// A tag behind bytes that only who has the key can make: the first 16 bytes of HMAC-SHA256 (RFC
/// 2104) over a name, a zero and the bytes. Decoders of LCM do not look behind the message. What
/// was recorded and is sent again carries a good tag: see Heard.
class Seal {
 public:
  using Key = std::array<uint8_t, 32>;
  static constexpr size_t kTagBytes = 16;

  /// Without a key nothing is sealed and nothing refused.
  Seal() = default;
  explicit Seal(const Key& key) : key_(key) {}

  bool on() const { return key_.has_value(); }
  void Close(const std::string& name, std::vector<uint8_t>* bytes) const;
  /// How many of the bytes stand before the tag; nothing where it is not of this key.
  std::optional<size_t> Open(const std::string& name, const uint8_t* data, size_t size) const;

 private:
  std::array<uint8_t, kTagBytes> Tag(const std::string& name, const uint8_t* data,
                                     size_t size) const;

  std::optional<Key> key_;
};

/// What has come on one channel. What was recorded there and is sent again has a `seq` that its
/// sender's process has passed; from before the receiver began only its age tells.
class Heard {
 public:
  /// Is it newer than all that this process of its sender said here before?
  bool IsNew(const MessageHead& head);

 private:
  std::map<std::pair<std::string, int64_t>, int32_t> newest_;  // seq, by sender and its start
};

/// From a file of 64 hexadecimal digits; without a name, one that does nothing. Throws
/// std::runtime_error, one line with the cure.
Seal LoadSeal(const std::string& file);

}  // namespace chase::bus
