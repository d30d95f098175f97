#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <type_traits>

#include "common/mavlink/mavlink_messages.h"

/// Messages to payload bytes and back (mavlink.io/en/guide/serialization.html): little endian, the
/// fields in wire order without padding, which this host's own memory holds as they are.
namespace chase::mavlink {

static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "fields are copied as they lie in memory");

inline constexpr std::size_t kMaxPayload = 255;

/// Payload bytes; those beyond the length are zero.
struct Payload {
  std::array<uint8_t, kMaxPayload> bytes{};
  std::size_t length = 0;
};

namespace detail {
struct FieldWriter {
  std::array<uint8_t, kMaxPayload>* bytes;
  template <class T>
  void operator()(const char*, std::size_t offset, const T& field) {
    static_assert(std::is_trivially_copyable_v<T>);
    std::memcpy(bytes->data() + offset, &field, sizeof field);
  }
};
struct FieldReader {
  const std::array<uint8_t, kMaxPayload>* bytes;
  template <class T>
  void operator()(const char*, std::size_t offset, T& field) {
    std::memcpy(&field, bytes->data() + offset, sizeof field);
  }
};
}  // namespace detail

/// All bytes of the message, zeros at the end included.
template <class M>
Payload ToPayload(const M& message) {
  Payload payload;
  detail::FieldWriter writer{&payload.bytes};
  M::Visit(message, writer);
  payload.length = M::kLength;
  return payload;
}

/// What a payload does not carry (cut zeros, extensions of a newer definition) is zero.
template <class M>
M FromPayload(const Payload& payload) {
  M message;
  detail::FieldReader reader{&payload.bytes};
  M::Visit(message, reader);
  return message;
}

/// The characters up to the first zero.
template <std::size_t N>
std::string_view Text(const std::array<char, N>& text) {
  return {text.data(),
          static_cast<std::size_t>(std::find(text.begin(), text.end(), '\0') - text.begin())};
}

}  // namespace chase::mavlink
