#pragma once

#include <cstdint>
#include <string>

#include "services/lidar/vlp16.h"

namespace chase::lidar {

/// Decides from the packets themselves whether a VLP-16 sends them. The product byte alone does
/// not: some VLP-16 recordings carry the HDL-32E's 0x21. What tells is the time from packet to
/// packet: 1327 us (dual 664 us) from a VLP-16, 553 us (dual 276 us) from an HDL-32E.
class ModelCheck {
 public:
  enum class Verdict { kUndecided, kVlp16, kOther };

  /// Takes the next packet's bytes, which PacketProblem() has passed.
  Verdict Add(const uint8_t* data);

  Verdict verdict() const { return verdict_; }
  /// Why the sensor is refused: one sentence with the evidence.
  const std::string& reason() const { return reason_; }

 private:
  Verdict Refuse(const std::string& what);
  Verdict JudgeInterval(const uint8_t* data, double interval_us);

  Verdict verdict_ = Verdict::kUndecided;
  std::string reason_;
  bool has_last_ = false;
  uint32_t last_stamp_us_ = 0;
  int odd_intervals_ = 0;
};

}  // namespace chase::lidar
