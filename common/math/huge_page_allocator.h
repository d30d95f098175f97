#pragma once

#include <sys/mman.h>

#include <algorithm>
#include <cstddef>
#include <cstdlib>
#include <new>

namespace chase::math {

/// For arrays that are read all over: those of a megabyte or more come on huge pages where the
/// system grants them (madvise(2)), so that the processor finds their addresses at once.
template <class T>
struct HugePageAllocator {
  using value_type = T;
  static constexpr size_t kPage = size_t{2} << 20;  // bytes: x86-64, and ARM64 with pages of 4 KiB
  static constexpr size_t kLeast = size_t{1} << 20;

  HugePageAllocator() = default;
  template <class U>
  HugePageAllocator(const HugePageAllocator<U>& /*other*/) {}  // containers convert it

  T* allocate(size_t n) {
    const bool huge = n * sizeof(T) >= kLeast;
    const size_t alignment = huge ? kPage : std::max(alignof(T), alignof(std::max_align_t));
    const size_t size = (n * sizeof(T) + alignment - 1) / alignment * alignment;
    void* memory = std::aligned_alloc(alignment, size);
    if (memory == nullptr) throw std::bad_alloc();
    if (huge) madvise(memory, size, MADV_HUGEPAGE);  // refused: ordinary pages do as well
    return static_cast<T*>(memory);
  }
  void deallocate(T* memory, size_t /*n*/) { std::free(memory); }

  bool operator==(const HugePageAllocator& /*other*/) const { return true; }
  bool operator!=(const HugePageAllocator& /*other*/) const { return false; }
};

}  // namespace chase::math
