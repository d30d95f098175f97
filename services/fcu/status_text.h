#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "services/fcu/mavlink.h"

namespace chase::fcu {

struct StatusText {
  uint8_t severity = 0;  ///< MAV_SEVERITY
  std::string text;
};

/// Joins the chunks of STATUSTEXT: those of one id come in order, the last is not full. A chunk
/// that is missing is shown as "...".
class StatusTexts {
 public:
  /// The whole text where `m` completes one; what is no printable character is a space.
  std::optional<StatusText> Add(int64_t utime, const mav::Statustext& m);

 private:
  struct Open {
    StatusText text;
    int64_t begun;
    int next = 0;
  };
  std::map<uint16_t, Open> open_;  // by id
};

}  // namespace chase::fcu
