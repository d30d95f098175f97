#include "services/mapping/assignment.h"

#include <algorithm>
#include <cmath>

namespace chase::mapping {

std::vector<int> Assign(const Eigen::MatrixXd& cost, double unassigned) {
  const int rows = static_cast<int>(cost.rows()), columns = static_cast<int>(cost.cols());
  const int m = columns + rows;  // one spare column per row stands for "unassigned"
  const auto price = [&](int i, int j) {
    if (j >= columns) return unassigned;
    const double c = cost(i, j);
    return std::isfinite(c) ? std::min(c, 2.0 * unassigned + 1.0) : 2.0 * unassigned + 1.0;
  };
  std::vector<double> u(static_cast<size_t>(rows) + 1, 0.0), v(static_cast<size_t>(m) + 1, 0.0);
  std::vector<int> owner(static_cast<size_t>(m) + 1, 0);  // row of a column, from 1; 0: free
  for (int i = 1; i <= rows; ++i) {
    std::vector<double> slack(static_cast<size_t>(m) + 1, INFINITY);
    std::vector<int> previous(static_cast<size_t>(m) + 1, 0);
    std::vector<char> used(static_cast<size_t>(m) + 1, 0);
    size_t j0 = 0;
    owner[0] = i;
    do {
      used[j0] = 1;
      const int row = owner[j0];
      double delta = INFINITY;
      size_t j1 = 0;
      for (size_t j = 1; j <= static_cast<size_t>(m); ++j) {
        if (used[j]) continue;
        const double reduced =
            price(row - 1, static_cast<int>(j) - 1) - u[static_cast<size_t>(row)] - v[j];
        if (reduced < slack[j]) slack[j] = reduced, previous[j] = static_cast<int>(j0);
        if (slack[j] < delta) delta = slack[j], j1 = j;
      }
      for (size_t j = 0; j <= static_cast<size_t>(m); ++j) {
        if (used[j]) {
          u[static_cast<size_t>(owner[j])] += delta;
          v[j] -= delta;
        } else {
          slack[j] -= delta;
        }
      }
      j0 = j1;
    } while (owner[j0] != 0);
    while (j0 != 0) {
      const size_t j1 = static_cast<size_t>(previous[j0]);
      owner[j0] = owner[j1];
      j0 = j1;
    }
  }
  std::vector<int> result(static_cast<size_t>(rows), -1);
  for (int j = 1; j <= columns; ++j)
    if (owner[static_cast<size_t>(j)])
      result[static_cast<size_t>(owner[static_cast<size_t>(j)]) - 1] = j - 1;
  return result;
}

}  // namespace chase::mapping
