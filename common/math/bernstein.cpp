#include "common/math/bernstein.h"

#include <algorithm>
#include <cmath>

namespace chase::math {
namespace {

constexpr double kRounding = 0x1p-53;

int Degree(const Polynomial& p) { return static_cast<int>(p.size()) - 1; }

Positivity DecideAtDepth(const Polynomial& b, double error, double step, int depth) {
  const double low = b.minCoeff();
  if (low > error) return Positivity::kPositive;
  const double lowest_end = std::min(b[0], b[b.size() - 1]);
  if (lowest_end < -error) return Positivity::kNotPositive;
  if (depth == 0 || lowest_end <= error) return Positivity::kUndecided;
  Polynomial left, right;
  SplitBernstein(b, 0.5, &left, &right);
  const Positivity first = DecideAtDepth(left, error + step, step, depth - 1);
  if (first == Positivity::kNotPositive) return first;
  const Positivity second = DecideAtDepth(right, error + step, step, depth - 1);
  return second == Positivity::kPositive ? first : second;
}

/// Worked out once, for the degrees that polynomials may have.
class ShareTable {
 public:
  ShareTable() {
    for (int n = 0; n < kSize; ++n)
      for (int j = 0; j <= n; ++j)
        for (int k = 0; k <= j; ++k) shares_[n][j][k] = Binomial(j, k) / Binomial(n, k);
  }
  double operator()(int n, int j, int k) const { return shares_[n][j][k]; }

 private:
  static constexpr int kSize = Polynomial::MaxRowsAtCompileTime;
  double shares_[kSize][kSize][kSize] = {};
};

}  // namespace

double BernsteinShare(int n, int j, int k) {
  static const ShareTable shares;
  return shares(n, j, k);
}

Polynomial PowerToBernstein(const Polynomial& power) {
  const int n = Degree(power);
  Polynomial b = Polynomial::Zero(n + 1);
  for (int j = 0; j <= n; ++j)
    for (int k = 0; k <= j; ++k) b[j] += BernsteinShare(n, j, k) * power[k];
  return b;
}

Polynomial BernsteinToPower(const Polynomial& bernstein) {
  const int n = Degree(bernstein);
  Polynomial p = Polynomial::Zero(n + 1);
  for (int k = 0; k <= n; ++k)
    for (int i = 0; i <= k; ++i)
      p[k] += ((k - i) % 2 ? -1.0 : 1.0) * Binomial(n, k) * Binomial(k, i) * bernstein[i];
  return p;
}

double EvaluateBernstein(const Polynomial& b, double t) {
  Polynomial c = b;
  for (Eigen::Index n = c.size() - 1; n > 0; --n)
    for (Eigen::Index i = 0; i < n; ++i) c[i] = (1.0 - t) * c[i] + t * c[i + 1];
  return c[0];
}

void SplitBernstein(const Polynomial& b, double t, Polynomial* left, Polynomial* right) {
  const Eigen::Index n = b.size() - 1;
  *right = b;
  left->resize(n + 1);
  (*left)[0] = b[0];
  for (Eigen::Index k = 1; k <= n; ++k) {
    for (Eigen::Index i = 0; i <= n - k; ++i)
      (*right)[i] = t == 0.5 ? 0.5 * ((*right)[i] + (*right)[i + 1])
                             : (1.0 - t) * (*right)[i] + t * (*right)[i + 1];
    (*left)[k] = (*right)[0];
  }
}

Polynomial BernsteinProduct(const Polynomial& a, const Polynomial& b) {
  const int n = Degree(a), m = Degree(b);
  Polynomial c = Polynomial::Zero(n + m + 1);
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= m; ++j)
      c[i + j] += Binomial(n, i) * Binomial(m, j) / Binomial(n + m, i + j) * a[i] * b[j];
  return c;
}

Polynomial ElevateBernstein(const Polynomial& b, int degree) {
  const int extra = degree - Degree(b);
  return extra <= 0 ? b : BernsteinProduct(b, Polynomial::Ones(extra + 1));
}

Positivity DecidePositive(const Polynomial& b, double error, int max_depth) {
  const double magnitude = b.cwiseAbs().maxCoeff();
  if (!(magnitude < 1e300) || !(error >= 0.0)) return Positivity::kUndecided;
  // 1 % covers the roundings of this bound itself.
  const double step = 1.01 * Degree(b) * kRounding * magnitude;
  return DecideAtDepth(b, error, step, max_depth);
}

double PowerToBernsteinError(const Polynomial& power) {
  return static_cast<double>(power.size() + 5) * kRounding * power.cwiseAbs().sum();
}

}  // namespace chase::math
