#include "services/planning/small_form.h"

#include <algorithm>
#include <cmath>

#include "services/planning/product_weights.h"

namespace chase::planning {

using math::Positivity;

namespace {

constexpr double kRounding = 0x1p-53;
constexpr double kUp = 1.0 + 1e-14, kDown = 1.0 - 1e-14;  // above the rounding of a product

Positivity Both(Positivity first, Positivity second) {
  if (first == Positivity::kNotPositive || second == Positivity::kNotPositive)
    return Positivity::kNotPositive;
  return first == Positivity::kPositive ? second : first;
}

}  // namespace

SmallForms::SmallForms(int n, const double (*x)[3], double X, const double (*y)[3], double Y,
                       const Eigen::Matrix3d& R)
    : degree_(2 * n) {
  const WeightTable& w = ProductWeights(n);
  for (int k = 0; k <= degree_; ++k) root_.b[k] = Lanes{-1.0, -1.0, -1.0, 0.0};
  Lanes right[7][3];
  for (int j = 0; j <= n; ++j)
    for (int a = 0; a < 3; ++a) right[j][a] = Lanes{x[j][a], y[j][a], y[j][a], 0.0};
  for (int i = 0; i <= n; ++i) {
    Lanes left[3];
    for (int a = 0; a < 3; ++a) {
      const double p = R(a, 0) * x[i][0] + R(a, 1) * x[i][1] + R(a, 2) * x[i][2];
      const double q = R(a, 0) * y[i][0] + R(a, 1) * y[i][1] + R(a, 2) * y[i][2];
      left[a] = Lanes{p, q, p, 0.0};
    }
    for (int j = 0; j <= n; ++j) {
      const double v = w.value[i][j];
      root_.b[i + j] += Lanes{v, v, v, v} *
                        (left[0] * right[j][0] + left[1] * right[j][1] + left[2] * right[j][2]);
    }
  }
  const double unit = 64.0 * kRounding, sum = R.cwiseAbs().sum();
  root_.error = Lanes{unit * (1.0 + X * X * sum), unit * (1.0 + Y * Y * sum),
                      unit * (1.0 + X * Y * sum), 0.0};
  Lanes largest{};
  for (int k = 0; k <= degree_; ++k) largest = -Min(-largest, Min(root_.b[k], -root_.b[k]));
  const double s = 1.01 * degree_ * kRounding;
  step_ = Lanes{s, s, s, s} * largest;
}

void SmallForms::CutFrom(double from) {
  if (from <= 0.0) return;
  const Lanes at{from, from, from, from}, rest = Lanes{1.0, 1.0, 1.0, 1.0} - at;
  for (int k = degree_; k > 0; --k)
    for (int i = 0; i < k; ++i) root_.b[i] = rest * root_.b[i] + at * root_.b[i + 1];
  root_.error += Lanes{6.0, 6.0, 6.0, 6.0} * step_;
}

template <int D>
SmallForms::Lanes SmallForms::Lowest(const Piece& f) const {
  Lanes low = f.b[0];
#pragma GCC unroll 16
  for (int k = 1; k <= D; ++k) low = Min(low, f.b[k]);
  return low - f.error;
}

template <int D>
void SmallForms::Halve(const Piece& f, Piece* left, Piece* right) const {
  Lanes t[D + 1];
  for (int k = 0; k <= D; ++k) t[k] = f.b[k];
  left->b[0] = t[0];
  right->b[D] = t[D];
  double scale = 1.0;  // exact powers of two: sums instead of means
#pragma GCC unroll 16
  for (int k = 1; k <= D; ++k) {
#pragma GCC unroll 16
    for (int i = 0; i <= D - k; ++i) t[i] = t[i] + t[i + 1];
    scale *= 0.5;
    left->b[k] = t[0] * Lanes{scale, scale, scale, scale};
    right->b[D - k] = t[D - k] * Lanes{scale, scale, scale, scale};
  }
  left->error = right->error = f.error + step_;
}

Positivity SmallForms::AtEnd(Question question, Lanes value, Lanes error) {
  const Lanes low = value - error, high = value + error;
  if (question == kSafe)
    return high[0] < 0.0  ? Positivity::kNotPositive
           : low[0] > 0.0 ? Positivity::kPositive
                          : Positivity::kUndecided;
  if (high[0] < 0.0 || high[1] < 0.0) return Positivity::kNotPositive;
  const bool exact = question == kExactSight;
  const double p = std::max(0.0, high[0]), q = std::max(0.0, high[1]);
  if (high[2] < 0.0 && (!exact || p * q * kUp < high[2] * high[2])) return Positivity::kNotPositive;
  const bool clear = low[0] > 0.0 && low[1] > 0.0 &&
                     (low[2] > 0.0 || (exact && low[0] * low[1] * kDown > low[2] * low[2]));
  return clear ? Positivity::kPositive : Positivity::kUndecided;
}

template <int D>
Positivity SmallForms::Decide(Question question, const Piece& f, int depth) const {
  const Lanes low = Lowest<D>(f);
  if (low[0] > 0.0 &&
      (question == kSafe ||
       (low[1] > 0.0 &&
        (low[2] > 0.0 || (question == kExactSight && low[0] * low[1] * kDown > low[2] * low[2])))))
    return Positivity::kPositive;
  const Positivity first = AtEnd(question, f.b[0], f.error);
  if (first == Positivity::kNotPositive) return first;
  const Positivity last = AtEnd(question, f.b[D], f.error);
  if (last == Positivity::kNotPositive) return last;
  if (depth == 0 || first == Positivity::kUndecided || last == Positivity::kUndecided)
    return Positivity::kUndecided;
  Piece left, right;
  Halve<D>(f, &left, &right);
  const Positivity before = Decide<D>(question, left, depth - 1);
  if (before == Positivity::kNotPositive) return before;
  return Both(before, Decide<D>(question, right, depth - 1));
}

Positivity SmallForms::Decide(Question question, int depth) const {
  return degree_ == 10 ? Decide<10>(question, root_, depth) : Decide<12>(question, root_, depth);
}

Positivity SmallForms::DecideSafe(int depth) const { return Decide(kSafe, depth); }

Positivity SmallForms::DecideSight(bool exact, int depth) const {
  return Decide(exact ? kExactSight : kBoundedSight, depth);
}

}  // namespace chase::planning
