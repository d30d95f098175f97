#include "services/planning/field_of_view.h"

#include <algorithm>
#include <cmath>

#include "common/math/bernstein.h"
#include "services/planning/candidate_set.h"

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

struct Direction {
  double x, y;
  explicit Direction(double angle) : x(std::cos(angle)), y(std::sin(angle)) {}
};

// > 0 where (x, y) lies to the left of the direction.
double Left(const Direction& d, double x, double y) { return d.x * y - d.y * x; }

bool IsBetween(const Piece& piece, const Margins& m) {
  const double from = piece.yaw.maxCoeff() + m.angle - m.half_angle;
  const double to = piece.yaw.minCoeff() - m.angle + m.half_angle;
  if (!(from < to)) return false;
  const Direction first(from), last(to);
  for (Eigen::Index i = 0; i < piece.x.size(); ++i)
    if (!(Left(first, piece.x[i], piece.y[i]) > m.length) ||
        !(Left(last, piece.x[i], piece.y[i]) < -m.length))
      return false;
  return true;
}

bool IsBrokenAt(const Piece& piece, Eigen::Index i, Eigen::Index j, const Margins& m) {
  return Left(Direction(piece.yaw[j] - m.half_angle), piece.x[i], piece.y[i]) < -m.length ||
         Left(Direction(piece.yaw[j] + m.half_angle), piece.x[i], piece.y[i]) > m.length;
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
  double length = 0.0, angle = 0.0;
  for (int a = 0; a < 2; ++a)
    length += plan.col(a).cwiseAbs().sum() + target.col(a).cwiseAbs().sum();
  for (const double y : yaw) angle += std::abs(y);
  if (!std::isfinite(angle)) return false;
  // x, y and yaw as the three coordinates of a curve.
  const Eigen::Index turns = static_cast<Eigen::Index>(yaw.size());
  const Eigen::Index n = std::max({plan.rows(), target.rows(), turns});
  Piece whole;
  if (n > 16) return false;
  Curve all = Curve::Zero(n, 3);
  all.topLeftCorner(target.rows(), 2) = target.leftCols<2>();
  all.topLeftCorner(plan.rows(), 2) -= plan.leftCols<2>();
  all.col(2).head(turns) = Eigen::Map<const Eigen::VectorXd>(yaw.data(), turns);
  if (n <= 7) {
    const Points points = ToPoints(all, 6);
    whole = {points.col(0), points.col(1), points.col(2)};
  } else {
    whole = {math::PowerToBernstein(all.col(0)), math::PowerToBernstein(all.col(1)),
             math::PowerToBernstein(all.col(2))};
  }
  return Keeps(whole, {half_angle, kRounding * (1.0 + length), kRounding * (1.0 + angle)}, kDepth);
}

}  // namespace chase::planning
