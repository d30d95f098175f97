#pragma once

#include <algorithm>
#include <random>
#include <utility>
#include <vector>

namespace chase::test {

/// What is under way on a bus that loses 20 %, sends 20 % twice and delays by up to 0.6 s.
template <class T>
class BadLine {
 public:
  explicit BadLine(std::mt19937* random) : random_(random) {}

  void Send(double t, const T& message) {
    std::uniform_real_distribution<double> u(0.0, 1.0);
    const int copies = u(*random_) < 0.2 ? 0 : u(*random_) < 0.2 ? 2 : 1;
    for (int i = 0; i < copies; ++i) in_flight_.push_back({t + 0.6 * u(*random_), message});
  }

  std::vector<T> Arrived(double t) {
    const auto late = std::stable_partition(in_flight_.begin(), in_flight_.end(),
                                            [t](const auto& m) { return m.first > t; });
    std::vector<T> out;
    for (auto m = late; m != in_flight_.end(); ++m) out.push_back(m->second);
    in_flight_.erase(late, in_flight_.end());
    return out;
  }

 private:
  std::mt19937* random_;
  std::vector<std::pair<double, T>> in_flight_;
};

}  // namespace chase::test
