#include "common/world/manoeuvre.h"

#include <cmath>

namespace chase::world {

double Manoeuvre::Variance(double t) const {
  const double x = std::abs(t) / memory, scale = acceleration * acceleration * std::pow(memory, 4);
  if (x >= 1.0)
    return scale * (2.0 / 3.0 * x * x * x - x * x + 2.0 - 2.0 * (1.0 + x) * std::exp(-x));
  // The same as a series, x^4 / 4 - x^5 / 15 + ...: above, nearly all of it cancels.
  constexpr int kTerms = 20;
  double sum = 0.0, power = x * x * x;  // (-x)^k / k!, at k = 3 but for the sign and 3!
  power /= -6.0;
  for (int k = 4; k < kTerms; ++k) {
    power *= -x / k;
    sum += 2.0 * (k - 1) * power;
  }
  return scale * sum;
}

}  // namespace chase::world
