#pragma once

#include <array>
#include <cstring>
#include <tuple>
#include <type_traits>

#include "common/mavlink/framing.h"
#include "common/world/random.h"

namespace chase::mavlink::testing {

/// Fills any message with random bits; every fourth field stays zero, so that there are zeros to
/// cut. Floats are numbers or infinite, texts end at their first zero.
struct Randomizer {
  world::Random* random;

  template <class T>
  void operator()(const char*, std::size_t, T& field) {
    if (random->Next() % 4 != 0) Fill(&field);
  }

 private:
  template <class T>
  void Fill(T* value) {
    const uint64_t bits = random->Next();
    std::memcpy(value, &bits, sizeof *value);
    if constexpr (std::is_same_v<T, float>)
      if (*value != *value) *value = 1.0f;
  }
  template <class T, std::size_t N>
  void Fill(std::array<T, N>* values) {
    for (T& value : *values) Fill(&value);
  }
  template <std::size_t N>
  void Fill(std::array<char, N>* text) {
    const std::size_t length = random->Next() % (N + 1);
    for (std::size_t i = 0; i < length; ++i)
      (*text)[i] = static_cast<char>(1 + random->Next() % 255);
  }
};

template <class M>
M RandomMessage(world::Random* random) {
  M message;
  Randomizer randomizer{random};
  M::Visit(message, randomizer);
  return message;
}

/// Calls f(message) with a default message of the type of index `i`.
template <class F, std::size_t I = 0>
void WithType(std::size_t i, F&& f) {
  if constexpr (I < std::tuple_size_v<mav::AllMessages>) {
    if (i == I) return f(std::tuple_element_t<I, mav::AllMessages>{});
    WithType<F, I + 1>(i, std::forward<F>(f));
  }
}
inline constexpr std::size_t kTypes = std::tuple_size_v<mav::AllMessages>;

template <class F>
void ForEachType(F&& f) {
  for (std::size_t i = 0; i < kTypes; ++i) WithType(i, f);
}

}  // namespace chase::mavlink::testing
