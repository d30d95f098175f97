#include "services/planning/small_form.h"

#include <algorithm>
#include <cmath>

#include "services/planning/product_weights.h"

namespace chase::planning {
namespace {

using math::Positivity;

constexpr double kRounding = 0x1p-53;
constexpr double kUp = 1.0 + 1e-14, kDown = 1.0 - 1e-14;  // above the rounding of a product

double Lowest(int degree, const SmallForm& f) {
  double low = f.b[0];
  for (int k = 1; k <= degree; ++k) low = std::min(low, f.b[k]);
  return low - f.error;
}

double Largest(int degree, const SmallForm& f) {
  double high = 0.0;
  for (int k = 0; k <= degree; ++k) high = std::max(high, std::abs(f.b[k]));
  return high;
}

// Halves; an average rounds by at most u times the largest coefficient, `degree` times over.
void Halve(int degree, const SmallForm& f, SmallForm* left, SmallForm* right) {
  double t[13];
  std::copy(f.b, f.b + degree + 1, t);
  left->b[0] = t[0];
  right->b[degree] = t[degree];
  for (int k = 1; k <= degree; ++k) {
    for (int i = 0; i <= degree - k; ++i) t[i] = 0.5 * (t[i] + t[i + 1]);
    left->b[k] = t[0];
    right->b[degree - k] = t[degree - k];
  }
  left->error = right->error = f.error + 1.01 * degree * kRounding * Largest(degree, f);
}

Positivity Both(Positivity first, Positivity second) {
  if (first == Positivity::kNotPositive || second == Positivity::kNotPositive)
    return Positivity::kNotPositive;
  return first == Positivity::kPositive ? second : first;
}

/// Verdict at one end of an interval.
Positivity AtEnd(double p, double pe, double q, double qe, double s, double se, bool exact) {
  if (p < -pe || q < -qe) return Positivity::kNotPositive;
  const double p_high = std::max(0.0, p + pe), q_high = std::max(0.0, q + qe), s_high = s + se;
  if (s_high < 0.0 && (!exact || p_high * q_high * kUp < s_high * s_high))
    return Positivity::kNotPositive;
  const double p_low = p - pe, q_low = q - qe, s_low = s - se;
  const bool clear = p_low > 0.0 && q_low > 0.0 &&
                     (s_low > 0.0 || (exact && p_low * q_low * kDown > s_low * s_low));
  return clear ? Positivity::kPositive : Positivity::kUndecided;
}

}  // namespace

SmallForm MakeForm(int n, const double (*x)[3], double X, const Eigen::Matrix3d& R,
                   const double (*y)[3], double Y) {
  SmallForm f{};
  const WeightTable& w = ProductWeights(n);
  double sum = 0.0;
  for (int i = 0; i < 9; ++i) sum += std::abs(R.data()[i]);
  for (int k = 0; k <= 2 * n; ++k) f.b[k] = -1.0;
  for (int i = 0; i <= n; ++i) {
    double z[3];
    for (int a = 0; a < 3; ++a) z[a] = R(a, 0) * x[i][0] + R(a, 1) * x[i][1] + R(a, 2) * x[i][2];
    for (int j = 0; j <= n; ++j)
      f.b[i + j] += w.value[i][j] * (z[0] * y[j][0] + z[1] * y[j][1] + z[2] * y[j][2]);
  }
  f.error = 64.0 * kRounding * (1.0 + X * Y * sum);
  return f;
}

void CutFrom(int degree, double from, SmallForm* f) {
  if (from <= 0.0) return;
  f->error += 4.0 * (degree + 1) * kRounding * Largest(degree, *f);
  for (int k = degree; k > 0; --k)
    for (int i = 0; i < k; ++i) f->b[i] = (1.0 - from) * f->b[i] + from * f->b[i + 1];
}

Positivity DecideSafe(int degree, const SmallForm& P, int depth) {
  if (Lowest(degree, P) > 0.0) return Positivity::kPositive;
  if (P.b[0] < -P.error || P.b[degree] < -P.error) return Positivity::kNotPositive;
  if (depth == 0 || P.b[0] <= P.error || P.b[degree] <= P.error) return Positivity::kUndecided;
  SmallForm left, right;
  Halve(degree, P, &left, &right);
  const Positivity first = DecideSafe(degree, left, depth - 1);
  if (first == Positivity::kNotPositive) return first;
  return Both(first, DecideSafe(degree, right, depth - 1));
}

Positivity DecideSight(int degree, const SmallForm& P, const SmallForm& Q, const SmallForm& S,
                       bool exact, int depth) {
  const double p = Lowest(degree, P), q = Lowest(degree, Q), s = Lowest(degree, S);
  if (p > 0.0 && q > 0.0 && (s > 0.0 || (exact && p * q * kDown > s * s)))
    return Positivity::kPositive;
  bool open = false;
  for (const int e : {0, degree}) {
    const Positivity end = AtEnd(P.b[e], P.error, Q.b[e], Q.error, S.b[e], S.error, exact);
    if (end == Positivity::kNotPositive) return end;
    open = open || end == Positivity::kUndecided;
  }
  if (depth == 0 || open) return Positivity::kUndecided;
  SmallForm left[3], right[3];
  Halve(degree, P, &left[0], &right[0]);
  Halve(degree, Q, &left[1], &right[1]);
  Halve(degree, S, &left[2], &right[2]);
  const Positivity first = DecideSight(degree, left[0], left[1], left[2], exact, depth - 1);
  if (first == Positivity::kNotPositive) return first;
  return Both(first, DecideSight(degree, right[0], right[1], right[2], exact, depth - 1));
}

}  // namespace chase::planning
