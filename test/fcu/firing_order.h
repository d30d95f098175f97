#pragma once

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <vector>

#include "services/simulator/lidar.h"

namespace chase::testing {

/// The points of a sweep in the order of their firing times, as a sensor sends them: the simulation
/// keeps those of a firing sequence by ring.
inline std::vector<std::size_t> FiringOrder(const simulator::Sweep& sweep) {
  std::vector<std::size_t> order(sweep.t.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return sweep.t[a] < sweep.t[b]; });
  return order;
}

}  // namespace chase::testing
