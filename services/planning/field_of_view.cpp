#include "services/planning/field_of_view.h"

#include <algorithm>
#include <cmath>

#include "common/math/bernstein.h"

namespace chase::planning {
namespace {

using math::Polynomial;

constexpr int kDepth = 12;
constexpr double kRounding = 1e-12;  // of all steps, relative to the sums of coefficients

struct Piece {
  Polynomial x, y, yaw;  // target - plan and yaw in Bernstein form
};

struct Margins {
  double half_angle, length, angle;
};

// x cos(direction) and so on: > 0 where (x, y) lies to the left of the direction.
double Left(double direction, double x, double y) {
  return std::cos(direction) * y - std::sin(direction) * x;
}

bool IsBetween(const Piece& piece, const Margins& m) {
  const double from = piece.yaw.maxCoeff() + m.angle - m.half_angle;
  const double to = piece.yaw.minCoeff() - m.angle + m.half_angle;
  if (!(from < to)) return false;
  for (Eigen::Index i = 0; i < piece.x.size(); ++i)
    if (!(Left(from, piece.x[i], piece.y[i]) > m.length) ||
        !(Left(to, piece.x[i], piece.y[i]) < -m.length))
      return false;
  return true;
}

bool IsBrokenAt(const Piece& piece, Eigen::Index i, Eigen::Index j, const Margins& m) {
  return Left(piece.yaw[j] - m.half_angle, piece.x[i], piece.y[i]) < -m.length ||
         Left(piece.yaw[j] + m.half_angle, piece.x[i], piece.y[i]) > m.length;
}

bool Keeps(const Piece& piece, const Margins& m, int depth) {
  if (IsBetween(piece, m)) return true;
  if (depth == 0 || IsBrokenAt(piece, 0, 0, m) ||
      IsBrokenAt(piece, piece.x.size() - 1, piece.yaw.size() - 1, m))
    return false;
  Piece left, right;
  math::SplitBernstein(piece.x, 0.5, &left.x, &right.x);
  math::SplitBernstein(piece.y, 0.5, &left.y, &right.y);
  math::SplitBernstein(piece.yaw, 0.5, &left.yaw, &right.yaw);
  return Keeps(left, m, depth - 1) && Keeps(right, m, depth - 1);
}

}  // namespace

bool KeepsBearing(const Curve& plan, const Curve& target, const std::vector<double>& yaw,
                  double half_angle) {
  if (yaw.empty() || !plan.allFinite() || !target.allFinite()) return false;
  Polynomial r[2];
  double length = 0.0, angle = 0.0;
  for (int a = 0; a < 2; ++a) {
    r[a] = Polynomial::Zero(std::max(plan.rows(), target.rows()));
    r[a].head(target.rows()) = target.col(a);
    r[a].head(plan.rows()) -= plan.col(a);
    length += plan.col(a).cwiseAbs().sum() + target.col(a).cwiseAbs().sum();
  }
  for (const double y : yaw) angle += std::abs(y);
  if (!std::isfinite(angle)) return false;
  const Polynomial turn =
      Eigen::Map<const Eigen::VectorXd>(yaw.data(), static_cast<Eigen::Index>(yaw.size()));
  const Piece whole{math::PowerToBernstein(r[0]), math::PowerToBernstein(r[1]),
                    math::PowerToBernstein(turn)};
  return Keeps(whole, {half_angle, kRounding * (1.0 + length), kRounding * (1.0 + angle)}, kDepth);
}

}  // namespace chase::planning
