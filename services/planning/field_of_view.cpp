#include "services/planning/field_of_view.h"

#include <algorithm>
#include <cmath>

#include "common/math/bernstein.h"

namespace chase::planning {
namespace {

constexpr double kGravity = 9.80665;  // m/s^2
constexpr double kSlack = 1e-9;       // of all rounding, relative
constexpr int kMost = 12;             // coefficients of a curve
constexpr int kDepth = 7;             // halvings

struct Range {
  double low, high;
};
Range operator+(Range a, Range b) { return {a.low + b.low, a.high + b.high}; }
Range operator*(double s, Range a) {
  return s < 0.0 ? Range{s * a.high, s * a.low} : Range{s * a.low, s * a.high};
}
Range operator*(Range a, Range b) {
  const double p[] = {a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high};
  return {std::min({p[0], p[1], p[2], p[3]}), std::max({p[0], p[1], p[2], p[3]})};
}

/// What a function of s in [-1,1] is within: mid + slope s + rest. Affine arithmetic (de Figueiredo
/// & Stolfi 2004): the rests of sums and products shrink with the square of a piece's length.
struct Affine {
  double mid = 0.0, slope = 0.0;
  Range rest{0.0, 0.0};

  Range line() const { return {mid - std::abs(slope), mid + std::abs(slope)}; }
  Range range() const { return line() + rest; }
  /// Largest distance from mid.
  double reach() const { return std::abs(slope) + std::max(-rest.low, rest.high); }
};
Affine operator+(const Affine& a, const Affine& b) {
  return {a.mid + b.mid, a.slope + b.slope, a.rest + b.rest};
}
Affine operator*(double f, const Affine& a) { return {f * a.mid, f * a.slope, f * a.rest}; }
Affine operator-(const Affine& a, const Affine& b) { return a + -1.0 * b; }
Affine operator*(const Affine& a, const Affine& b) {
  const double square = a.slope * b.slope;
  return {
      a.mid * b.mid, a.mid * b.slope + a.slope * b.mid,
      Range{std::min(0.0, square), std::max(0.0, square)} + a.rest * b.range() + a.line() * b.rest};
}

/// Of a > 0, by Taylor's theorem about its middle.
Affine Root(const Affine& a) {
  const double root = std::sqrt(a.mid), d = a.reach(), low = a.range().low;
  const double bend = d * d / (8.0 * low * std::sqrt(low));
  return {root, 0.5 / root * a.slope, 0.5 / root * a.rest + Range{-bend, 0.0}};
}

/// Cosine of the angle less `quarters` quarter turns: of 1 its sine.
Affine Cosine(const Affine& a, int quarters) {
  const double phase = a.mid - 0.5 * M_PI * quarters, fall = -std::sin(phase), d = a.reach();
  return {std::cos(phase), fall * a.slope, fall * a.rest + Range{-0.5 * d * d, 0.5 * d * d}};
}

/// Bernstein coefficients.
struct Coefficients {
  int n = 1;
  double c[kMost] = {};

  /// The line from the first to the last, and how far the others are off it.
  Affine affine() const {
    const double step = n > 1 ? (c[n - 1] - c[0]) / (n - 1) : 0.0;
    Affine a{0.5 * (c[0] + c[n - 1]), 0.5 * (c[n - 1] - c[0])};
    for (int i = 1; i + 1 < n; ++i) {
      const double off = c[i] - (c[0] + step * i);
      a.rest = {std::min(a.rest.low, off), std::max(a.rest.high, off)};
    }
    return a;
  }
  Coefficients End(bool last) const { return {1, {c[last ? n - 1 : 0]}}; }
};

void Split(const Coefficients& whole, double at, Coefficients* left, Coefficients* right) {
  left->n = right->n = whole.n;
  std::copy(whole.c, whole.c + whole.n, right->c);
  left->c[0] = right->c[0];
  for (int k = 1; k < whole.n; ++k) {
    for (int i = 0; i + k < whole.n; ++i)
      right->c[i] = (1.0 - at) * right->c[i] + at * right->c[i + 1];
    left->c[k] = right->c[0];
  }
}

/// Of a plan: target - plan, the thrust over mass that it takes, and the yaw where there is one.
struct Piece {
  Coefficients r[3], f[3], yaw;
  bool has_yaw = false;

  Piece End(bool last) const {
    Piece end;
    for (int a = 0; a < 3; ++a) end.r[a] = r[a].End(last), end.f[a] = f[a].End(last);
    end.yaw = yaw.End(last);
    end.has_yaw = has_yaw;
    return end;
  }
};

void Split(const Piece& whole, double at, Piece* left, Piece* right) {
  for (int a = 0; a < 3; ++a) {
    Split(whole.r[a], at, &left->r[a], &right->r[a]);
    Split(whole.f[a], at, &left->f[a], &right->f[a]);
  }
  Split(whole.yaw, at, &left->yaw, &right->yaw);
  left->has_yaw = right->has_yaw = whole.has_yaw;
}

/// The target in the body's frame, forward, left and down, each times the same positive number.
struct Seen {
  Affine forward, left, down;
};

/// With the heading towards the target `left` is not asked for, and left out.
std::optional<Seen> SeenFrom(const Piece& piece) {
  Affine r[3], f[3];
  for (int a = 0; a < 3; ++a) r[a] = piece.r[a].affine(), f[a] = piece.f[a].affine();
  const Affine &z = r[2], &up = f[2];
  if (!(up.range().low > 0.0)) return std::nullopt;
  if (!piece.has_yaw) {  // times the level distance, which is the root of h
    const Affine h = r[0] * r[0] + r[1] * r[1];
    const Affine along = f[0] * r[0] + f[1] * r[1], across = f[1] * r[0] - f[0] * r[1];
    const Affine lateral2 = up * up * h + across * across;
    if (!(lateral2.range().low > 0.0)) return std::nullopt;
    return Seen{lateral2 - z * up * along, {}, -1.0 * ((along + z * up) * Root(lateral2))};
  }
  const Affine yaw = piece.yaw.affine();
  const Affine cosine = Cosine(yaw, 0), sine = Cosine(yaw, 1);
  const Affine x = cosine * r[0] + sine * r[1], y = cosine * r[1] - sine * r[0];
  const Affine ax = cosine * f[0] + sine * f[1], ay = cosine * f[1] - sine * f[0];
  const Affine lateral2 = up * up + ay * ay, thrust2 = lateral2 + ax * ax;
  if (!(lateral2.range().low > 0.0) || !(thrust2.range().low > 0.0)) return std::nullopt;
  return Seen{x * lateral2 - y * ax * ay - z * up * ax, (y * up - z * ay) * Root(thrust2),
              -1.0 * ((x * ax + y * ay + z * up) * Root(lateral2))};
}

bool IsInside(const Piece& piece, const View& view) {
  const auto seen = SeenFrom(piece);
  if (!seen) return false;
  const auto most = [](const Affine& a) { return std::abs(a.mid) + a.reach(); };
  const Affine &forward = seen->forward, &down = seen->down;
  const double slack = kSlack * (most(forward) + most(down) + most(seen->left));
  if (!((down - view.down * forward).range().high < -slack)) return false;
  if (!((down + view.up * forward).range().low > slack)) return false;
  if (!piece.has_yaw) return true;
  const double pitch = 0.5 * (std::atan(view.down) - std::atan(view.up));
  const Affine side = view.side * (std::cos(pitch) * forward + std::sin(pitch) * down);
  return (seen->left - side).range().high < -slack && (seen->left + side).range().low > slack;
}

/// All pieces of a size before their halves: most of what leaves the view does so at an end.
bool Keeps(const Piece& whole, const View& view) {
  if (!IsInside(whole.End(false), view) || !IsInside(whole.End(true), view)) return false;
  std::vector<Piece> open{whole}, halves;
  for (int depth = 0; !open.empty(); ++depth) {
    halves.clear();
    for (const Piece& piece : open) {
      if (IsInside(piece, view)) continue;
      if (depth == kDepth) return false;
      Piece left, right;
      Split(piece, 0.5, &left, &right);
      if (!IsInside(left.End(true), view)) return false;
      halves.push_back(left);
      halves.push_back(right);
    }
    open.swap(halves);
  }
  return true;
}

bool Set(const math::Polynomial& power, Coefficients* out) {
  if (power.size() > kMost || !power.allFinite()) return false;
  const math::Polynomial b = math::PowerToBernstein(power);
  out->n = static_cast<int>(b.size());
  std::copy(b.data(), b.data() + b.size(), out->c);
  return true;
}

bool Set(const Curve& plan, const Curve& target, double duration, const std::vector<double>* yaw,
         double drag, Piece* piece) {
  const Eigen::Index n = std::max(plan.rows(), target.rows());
  for (int a = 0; a < 3; ++a) {
    math::Polynomial r = math::Polynomial::Zero(n);
    r.head(target.rows()) = target.col(a);
    r.head(plan.rows()) -= plan.col(a);
    const math::Polynomial rate = math::Derivative(plan.col(a)) / duration;
    math::Polynomial f = math::Derivative(rate) / duration;
    if (a < 2) f = math::Sum(f, rate, drag);
    if (a == 2) f[0] += kGravity;
    if (!Set(r, &piece->r[a]) || !Set(f, &piece->f[a])) return false;
  }
  piece->has_yaw = yaw != nullptr;
  return !yaw || (!yaw->empty() && Set(Eigen::Map<const Eigen::VectorXd>(
                                           yaw->data(), static_cast<Eigen::Index>(yaw->size())),
                                       &piece->yaw));
}

}  // namespace

bool KeepsView(const Curve& plan, const Curve& target, double duration,
               const std::vector<double>* yaw, const View& view, double from) {
  Piece whole;
  if (!Set(plan, target, duration, yaw, view.drag, &whole)) return false;
  if (from >= 1.0) return true;
  if (from > 0.0) {
    Piece before, after;
    Split(whole, from, &before, &after);
    whole = after;
  }
  return Keeps(whole, view);
}

double SeenBelow(const Eigen::Vector3d& to_target, const Eigen::Vector3d& v,
                 const Eigen::Vector3d& a, double drag) {
  Piece piece;
  const Eigen::Vector3d f = a + drag * Eigen::Vector3d(v.x(), v.y(), 0.0);
  for (int i = 0; i < 3; ++i) piece.r[i].c[0] = to_target[i], piece.f[i].c[0] = f[i];
  piece.f[2].c[0] += kGravity;
  const auto seen = SeenFrom(piece);
  return seen && seen->forward.mid > 0.0 ? seen->down.mid / seen->forward.mid : HUGE_VAL;
}

}  // namespace chase::planning
