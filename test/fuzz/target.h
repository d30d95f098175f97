#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>

/// What every target defines: one input, of any bytes. libFuzzer calls it, and replay_main.cpp.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

namespace chase::fuzz {

/// Ends the program where a promise about the reader under test is broken.
inline void Require(bool holds, const char* promise) {
  if (holds) return;
  std::fprintf(stderr, "broken promise: %s\n", promise);
  std::abort();
}

/// Calls f, which may refuse its input by one line about "fuzz", the input's name, and by nothing
/// else. True when it did not refuse.
template <class F>
bool Accepts(F f) {
  try {
    f();
    return true;
  } catch (const std::runtime_error& error) {
    const std::string what = error.what();
    Require(what.rfind("fuzz", 0) == 0, "a refusal begins with the input's name");
    return false;
  }
}

}  // namespace chase::fuzz
