#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "common/math/huge_page_allocator.h"

namespace chase::odometry {

/// The unit cube that holds u, as one number: 21 bits per axis.
inline uint64_t CellKey(const Eigen::Vector3f& u) {
  const auto cell = [](float x) {
    const int64_t truncated = static_cast<int64_t>(x);  // rounded down without a call
    const int64_t floor = truncated - (x < static_cast<float>(truncated) ? 1 : 0);
    return static_cast<uint64_t>(floor + (1 << 20)) & 0x1fffffu;
  };
  return cell(u.x()) | cell(u.y()) << 21 | cell(u.z()) << 42;
}

/// Numbers cells 0, 1, 2, ... in the order of their first appearance: an open-addressing hash table
/// whose content never depends on addresses or seeds.
class CellIndex {
 public:
  static constexpr int kNone = -1;

  CellIndex() : slots_(64) {}

  size_t size() const { return count_; }

  /// Brings near what a query of `key` will read: many queries then wait for memory together.
  void Prefetch(uint64_t key) const { __builtin_prefetch(&slots_[Home(key)]); }

  /// The cell's number, or kNone.
  int Find(uint64_t key) const { return slots_[Slot(key)].number; }

  int FindOrAdd(uint64_t key, bool* added) {
    if (2 * (count_ + 1) > slots_.size()) Grow();
    Entry& entry = slots_[Slot(key)];
    *added = entry.number == kNone;
    if (*added) entry = {key, static_cast<int>(count_++)};
    return entry.number;
  }

  /// Keeps its size: what was full once will be full again.
  void Clear() {
    count_ = 0;
    slots_.assign(slots_.size(), Entry{});
  }

  size_t MemoryBytes() const { return slots_.capacity() * sizeof(Entry); }

 private:
  struct Entry {
    uint64_t key = 0;
    int number = kNone;
  };
  using Slots = std::vector<Entry, math::HugePageAllocator<Entry>>;

  void Grow() {
    Slots old(slots_.size() * 2);
    old.swap(slots_);
    for (const Entry& entry : old)
      if (entry.number != kNone) slots_[Slot(entry.key)] = entry;
  }

  size_t Home(uint64_t key) const {
    return static_cast<size_t>((key * 0x9e3779b97f4a7c15ull) >> 20) & (slots_.size() - 1);
  }

  size_t Slot(uint64_t key) const {
    const size_t mask = slots_.size() - 1;
    size_t slot = Home(key);
    while (slots_[slot].number != kNone && slots_[slot].key != key) slot = (slot + 1) & mask;
    return slot;
  }

  Slots slots_;
  size_t count_ = 0;
};

}  // namespace chase::odometry
