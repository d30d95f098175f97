#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cstddef>
#include <initializer_list>
#include <vector>

namespace chase::world {

/// For tau in [from, to] the body stays on one side of a plane and the ball (or the two balls, and
/// so their convex hull) on the other: n' (p - c) >= h(n) + |n| r, h the support of the body with
/// its uncertainty.
struct Separation {
  double from = 0.0, to = 1.0;
  Eigen::Vector3d normal = Eigen::Vector3d::UnitX();  ///< n, frame W, |n|^2 in [1/2, 2]
};

/// Separations of a body whose intervals follow each other. Mostly there is one, and plans have a
/// hundred certificates: one alone takes no memory from the heap.
class Certificate {
 public:
  Certificate() = default;
  explicit Certificate(const Separation& one) : size_(1), one_(one) {}
  Certificate(std::initializer_list<Separation> all) {
    for (const Separation& s : all) push_back(s);
  }

  void push_back(const Separation& s) {
    if (size_ == 0) {
      one_ = s;
    } else {
      if (size_ == 1) more_.assign(1, one_);
      more_.push_back(s);
    }
    ++size_;
  }
  void erase(const Separation* at) {
    std::copy(at + 1, static_cast<const Separation*>(end()), begin() + (at - begin()));
    if (--size_ == 1) one_ = more_.front();
    more_.resize(size_ > 1 ? size_ : 0);
  }
  void clear() {
    more_.clear();
    size_ = 0;
  }

  size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  Separation* begin() { return size_ > 1 ? more_.data() : &one_; }
  Separation* end() { return begin() + size_; }
  const Separation* begin() const { return size_ > 1 ? more_.data() : &one_; }
  const Separation* end() const { return begin() + size_; }
  Separation& operator[](size_t i) { return begin()[i]; }
  const Separation& operator[](size_t i) const { return begin()[i]; }
  Separation& front() { return *begin(); }
  const Separation& front() const { return *begin(); }
  Separation& back() { return end()[-1]; }
  const Separation& back() const { return end()[-1]; }

 private:
  size_t size_ = 0;
  Separation one_;                ///< where there is one
  std::vector<Separation> more_;  ///< all, where there are more
};

}  // namespace chase::world
