#pragma once

#include <exception>
#include <lcm/lcm-cpp.hpp>

#include "common/bus/validation.h"

namespace chase::calibrate {

/// The event's message; false where it is malformed.
template <class T>
bool Decode(const lcm::LogEvent& event, T* m) {
  try {
    return m->decode(event.data, 0, event.datalen) == event.datalen && bus::Problem(*m).empty();
  } catch (const std::exception&) {  // generated decoders throw on negative lengths
    return false;
  }
}

}  // namespace chase::calibrate
