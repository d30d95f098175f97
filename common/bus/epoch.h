#pragma once

#include <cstdint>
#include <optional>

namespace chase::bus {

/// The frame W that a node works in. What is kept in W is void once the frame has changed.
class Epoch {
 public:
  /// True where `epoch` is another than the last one.
  bool Change(int32_t epoch) {
    const bool changed = epoch_ && *epoch_ != epoch;
    epoch_ = epoch;
    return changed;
  }
  /// Is a message of `epoch` in the frame that this node works in?
  bool Is(int32_t epoch) const { return !epoch_ || *epoch_ == epoch; }
  int32_t value() const { return epoch_.value_or(0); }

 private:
  std::optional<int32_t> epoch_;
};

}  // namespace chase::bus
