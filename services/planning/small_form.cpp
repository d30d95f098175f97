#include "services/planning/small_form.h"

#include <algorithm>
#include <cmath>

#include "services/planning/product_weights.h"

namespace chase::planning {

using math::Positivity;

namespace {

constexpr double kRounding = 0x1p-53;
constexpr double kUp = 1.0 + 1e-14, kDown = 1.0 - 1e-14;  // above the rounding of a product

typedef double Lanes __attribute__((vector_size(32)));  // P, Q, S, unused

inline Lanes Load(const double* p) { return Lanes{p[0], p[1], p[2], p[3]}; }
inline Lanes All(double x) { return Lanes{x, x, x, x}; }
inline Lanes Min(Lanes a, Lanes b) { return a < b ? a : b; }

inline void Store(Lanes v, double* p) {
  for (int l = 0; l < 4; ++l) p[l] = v[l];
}

Positivity Both(Positivity first, Positivity second) {
  if (first == Positivity::kNotPositive || second == Positivity::kNotPositive)
    return Positivity::kNotPositive;
  return first == Positivity::kPositive ? second : first;
}

}  // namespace

/// One decision on its way down.
class FormDecision {
 public:
  enum Question { kSafe, kExactSight, kBoundedSight };

  FormDecision(const SmallForms& forms, Question question)
      : degree_(forms.degree_), question_(question), step_(Load(forms.step_)) {
    for (int k = 0; k <= degree_; ++k) root_.b[k] = Load(forms.root_[k]);
    root_.error = Load(forms.error_);
  }

  Positivity Decide(int depth) const {
    return degree_ == 10 ? DecideOn<10>(root_, depth) : DecideOn<12>(root_, depth);
  }

 private:
  struct Piece {
    Lanes b[13], error;
  };

  bool IsClear(const Lanes& low) const {
    if (question_ == kSafe) return low[0] > 0.0;
    return low[0] > 0.0 && low[1] > 0.0 &&
           (low[2] > 0.0 ||
            (question_ == kExactSight && low[0] * low[1] * kDown > low[2] * low[2]));
  }

  Positivity AtEnd(const Lanes& value, const Lanes& error) const {
    const Lanes low = value - error, high = value + error;
    if (high[0] < 0.0 || (question_ != kSafe && high[1] < 0.0)) return Positivity::kNotPositive;
    if (question_ != kSafe && high[2] < 0.0) {
      const double p = std::max(0.0, high[0]), q = std::max(0.0, high[1]);
      if (question_ == kBoundedSight || p * q * kUp < high[2] * high[2])
        return Positivity::kNotPositive;
    }
    return IsClear(low) ? Positivity::kPositive : Positivity::kUndecided;
  }

  template <int D>
  void Halve(const Piece& f, Piece* left, Piece* right) const {
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
      left->b[k] = t[0] * All(scale);
      right->b[D - k] = t[D - k] * All(scale);
    }
    left->error = right->error = f.error + step_;
  }

  template <int D>
  Positivity DecideOn(const Piece& f, int depth) const {
    Lanes low = f.b[0];
#pragma GCC unroll 16
    for (int k = 1; k <= D; ++k) low = Min(low, f.b[k]);
    if (IsClear(low - f.error)) return Positivity::kPositive;
    const Positivity first = AtEnd(f.b[0], f.error);
    if (first == Positivity::kNotPositive) return first;
    const Positivity last = AtEnd(f.b[D], f.error);
    if (last == Positivity::kNotPositive) return last;
    if (depth == 0 || first == Positivity::kUndecided || last == Positivity::kUndecided)
      return Positivity::kUndecided;
    Piece left, right;
    Halve<D>(f, &left, &right);
    const Positivity before = DecideOn<D>(left, depth - 1);
    if (before == Positivity::kNotPositive) return before;
    return Both(before, DecideOn<D>(right, depth - 1));
  }

  int degree_;
  Question question_;
  Piece root_;
  Lanes step_;
};

SmallForms::SmallForms(int n, const double (*x)[3], double X, const double (*y)[3], double Y,
                       const Eigen::Matrix3d& R)
    : degree_(2 * n) {
  const WeightTable& w = ProductWeights(n);
  Lanes b[13], right[7][3];
  for (int k = 0; k <= degree_; ++k) b[k] = Lanes{-1.0, -1.0, -1.0, 0.0};
  for (int j = 0; j <= n; ++j)
    for (int a = 0; a < 3; ++a) right[j][a] = Lanes{x[j][a], y[j][a], y[j][a], 0.0};
  for (int i = 0; i <= n; ++i) {
    Lanes left[3];
    for (int a = 0; a < 3; ++a) {
      const double p = R(a, 0) * x[i][0] + R(a, 1) * x[i][1] + R(a, 2) * x[i][2];
      const double q = R(a, 0) * y[i][0] + R(a, 1) * y[i][1] + R(a, 2) * y[i][2];
      left[a] = Lanes{p, q, p, 0.0};
    }
    for (int j = 0; j <= n; ++j)
      b[i + j] += All(w.value[i][j]) *
                  (left[0] * right[j][0] + left[1] * right[j][1] + left[2] * right[j][2]);
  }
  const double unit = 64.0 * kRounding, sum = R.cwiseAbs().sum();
  Store(Lanes{unit * (1.0 + X * X * sum), unit * (1.0 + Y * Y * sum), unit * (1.0 + X * Y * sum),
              0.0},
        error_);
  Lanes largest{};
  for (int k = 0; k <= degree_; ++k) {
    largest = -Min(-largest, Min(b[k], -b[k]));
    Store(b[k], root_[k]);
  }
  Store(All(1.01 * degree_ * kRounding) * largest, step_);
}

void SmallForms::CutFrom(double from) {
  if (from <= 0.0) return;
  for (int l = 0; l < 4; ++l) {
    for (int k = degree_; k > 0; --k)
      for (int i = 0; i < k; ++i) root_[i][l] = (1.0 - from) * root_[i][l] + from * root_[i + 1][l];
    error_[l] += 6.0 * step_[l];
  }
}

Positivity SmallForms::DecideSafe(int depth) const {
  return FormDecision(*this, FormDecision::kSafe).Decide(depth);
}

Positivity SmallForms::DecideSight(bool exact, int depth) const {
  return FormDecision(*this, exact ? FormDecision::kExactSight : FormDecision::kBoundedSight)
      .Decide(depth);
}

}  // namespace chase::planning
