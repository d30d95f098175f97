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
Range operator-(Range a, Range b) { return {a.low - b.high, a.high - b.low}; }
Range operator*(double s, Range a) {
  return s < 0.0 ? Range{s * a.high, s * a.low} : Range{s * a.low, s * a.high};
}
Range operator*(Range a, Range b) {
  const double p[] = {a.low * b.low, a.low * b.high, a.high * b.low, a.high * b.high};
  return {std::min({p[0], p[1], p[2], p[3]}), std::max({p[0], p[1], p[2], p[3]})};
}
Range Squared(Range a) {
  const double l = a.low * a.low, h = a.high * a.high;
  return {a.low <= 0.0 && a.high >= 0.0 ? 0.0 : std::min(l, h), std::max(l, h)};
}
Range Root(Range a) { return {std::sqrt(std::max(0.0, a.low)), std::sqrt(a.high)}; }

/// Bernstein coefficients.
struct Coefficients {
  int n = 1;
  double c[kMost] = {};

  Range range() const {
    const auto [low, high] = std::minmax_element(c, c + n);
    return {*low, *high};
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

/// Directions within `half` (below pi/2) of the middle one.
struct Fan {
  double cosine, sine, half;

  /// Level coordinates along and across the middle direction.
  void Turn(const Coefficients* xy, Coefficients* along, Coefficients* across) const {
    along->n = across->n = xy[0].n;
    for (int i = 0; i < xy[0].n; ++i) {
      along->c[i] = cosine * xy[0].c[i] + sine * xy[1].c[i];
      across->c[i] = cosine * xy[1].c[i] - sine * xy[0].c[i];
    }
  }
};

std::optional<Fan> HeadingOf(const Piece& piece) {
  if (piece.has_yaw) {
    const Range yaw = piece.yaw.range();
    const double middle = 0.5 * (yaw.low + yaw.high), half = 0.5 * (yaw.high - yaw.low);
    if (!(half < 1.5)) return std::nullopt;
    return Fan{std::cos(middle), std::sin(middle), half};
  }
  Fan fan{0.0, 0.0, 0.0};
  for (int i = 0; i < piece.r[0].n; ++i) fan.cosine += piece.r[0].c[i], fan.sine += piece.r[1].c[i];
  const double length = std::hypot(fan.cosine, fan.sine);
  if (!(length > 0.0)) return std::nullopt;
  fan.cosine /= length, fan.sine /= length;
  Coefficients along, across;
  fan.Turn(piece.r, &along, &across);
  for (int i = 0; i < along.n; ++i) {
    if (!(along.c[i] > 0.0)) return std::nullopt;
    fan.half = std::max(fan.half, std::atan2(std::abs(across.c[i]), along.c[i]));
  }
  return fan;
}

/// The target in the body's frame, forward, left and down, each times the same positive number.
struct Seen {
  Range forward, left, down;
};

std::optional<Seen> SeenFrom(const Piece& piece) {
  const auto heading = HeadingOf(piece);
  if (!heading) return std::nullopt;
  const Range cosine{std::cos(heading->half), 1.0};
  const Range sine{-std::sin(heading->half), std::sin(heading->half)};
  const auto turned = [&](const Coefficients* xy, Range* x, Range* y) {
    Coefficients along, across;
    heading->Turn(xy, &along, &across);
    const Range a = along.range(), b = across.range();
    *x = cosine * a + sine * b;
    *y = cosine * b - sine * a;
  };
  Range x{}, y{}, ax{}, ay{};
  turned(piece.r, &x, &y);
  turned(piece.f, &ax, &ay);
  if (!piece.has_yaw) {
    x = {std::max(x.low, 0.0), x.high};
    y = {0.0, 0.0};
  }
  const Range z = piece.r[2].range(), up = piece.f[2].range();
  if (!(up.low > 0.0)) return std::nullopt;
  const Range lateral2 = Squared(up) + Squared(ay), lateral = Root(lateral2);
  const Range thrust = Root(lateral2 + Squared(ax));
  return Seen{x * lateral2 - y * ax * ay - z * up * ax, (y * up - z * ay) * thrust,
              -1.0 * ((x * ax + y * ay + z * up) * lateral)};
}

bool IsInside(const Piece& piece, const View& view) {
  const auto seen = SeenFrom(piece);
  if (!seen) return false;
  const Range forward = seen->forward, down = seen->down;
  const double slack = kSlack * (std::abs(forward.high) + std::abs(down.low) + std::abs(down.high) +
                                 std::abs(seen->left.high));
  if ((down - view.down * forward).high > -slack) return false;
  if ((down + view.up * forward).low < slack) return false;
  if (!piece.has_yaw) return true;
  const double pitch = 0.5 * (std::atan(view.down) - std::atan(view.up));
  const Range side = view.side * (std::cos(pitch) * forward + std::sin(pitch) * down);
  return (seen->left - side).high < -slack && (seen->left + side).low > slack;
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

Eigen::Vector2d SeenAt(const Eigen::Vector3d& to_target, const Eigen::Vector3d& v,
                       const Eigen::Vector3d& a, double drag, const double* yaw) {
  Piece piece;
  const Eigen::Vector3d f = a + drag * Eigen::Vector3d(v.x(), v.y(), 0.0);
  for (int i = 0; i < 3; ++i) piece.r[i].c[0] = to_target[i], piece.f[i].c[0] = f[i];
  piece.f[2].c[0] += kGravity;
  if (yaw) piece.yaw.c[0] = *yaw;
  piece.has_yaw = yaw != nullptr;
  const auto seen = SeenFrom(piece);
  if (!seen || !(seen->forward.low > 0.0)) return Eigen::Vector2d::Constant(HUGE_VAL);
  return {seen->down.low / seen->forward.low, seen->left.low / seen->forward.low};
}

}  // namespace chase::planning
