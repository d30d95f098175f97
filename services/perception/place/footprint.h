#pragma once

#include <Eigen/Core>
#include <cmath>
#include <limits>

namespace chase::perception {

/// A length in the plan view and its derivatives by what it depends on.
struct PlanLength {
  double value;
  double by_place = 0.0;  ///< by how far the line passes the centre
  double by_yaw = 0.0, by_half = 0.0;
};

/// Cross section of an upright cylinder or of an upright box with a square base, from its centre.
class Footprint {
 public:
  /// `half`: of its width [m]; `yaw` [rad] of a square.
  Footprint(bool square, double half, double yaw)
      : square_(square),
        half_(half),
        cos_(square ? std::cos(yaw) : 1.0),
        sin_(square ? std::sin(yaw) : 0.0) {}

  /// Its support function: how far it reaches along the unit vector n [m].
  PlanLength Reach(const Eigen::Vector2d& n) const {
    if (!square_) return {half_, 0.0, 0.0, 1.0};
    const Eigen::Vector2d m = Turned(n), side = Signs(m);
    return {half_ * m.lpNorm<1>(), 0.0, half_ * (side.x() * m.y() - side.y() * m.x()),
            m.lpNorm<1>()};
  }

  /// Where a line along the unit vector d leaves it (far: +1) or enters it (-1), along d from the
  /// foot of the centre, which stands `across` to the left of the line. A line that passes beside
  /// it, or nearly, counts as the outermost that still crosses it well.
  PlanLength Chord(const Eigen::Vector2d& d, double across, double far) const {
    const PlanLength reach = Reach({-d.y(), d.x()});
    const double most = std::copysign(kMostAcross, across);
    if (std::abs(across) < kMostAcross * reach.value)
      return square_ ? SquareChord(d, across, far) : RoundChord(across, far);
    PlanLength end =
        square_ ? SquareChord(d, most * reach.value, far) : RoundChord(most * reach.value, far);
    end.by_yaw += most * end.by_place * reach.by_yaw;
    end.by_half += most * end.by_place * reach.by_half;
    end.by_place = 0.0;
    return end;
  }

  /// Signed distance of q from it [m], negative inside; `by_q` the derivative.
  PlanLength Distance(const Eigen::Vector2d& q, Eigen::Vector2d* by_q) const {
    if (!square_) {
      const double from_axis = std::sqrt(q.squaredNorm() + 1e-12);
      *by_q = q / from_axis;
      return {from_axis - half_, 0.0, 0.0, -1.0};
    }
    const Eigen::Vector2d m = Turned(q), side = Signs(m), off = (m.cwiseAbs().array() - half_);
    Eigen::Vector2d by_m =
        off.x() > off.y() ? Eigen::Vector2d(side.x(), 0.0) : Eigen::Vector2d(0.0, side.y());
    double distance = off.maxCoeff();
    if (off.minCoeff() > 0.0) {
      distance = off.norm();
      by_m = off.cwiseProduct(side) / distance;
    }
    *by_q = {cos_ * by_m.x() - sin_ * by_m.y(), sin_ * by_m.x() + cos_ * by_m.y()};
    return {distance, 0.0, by_m.x() * m.y() - by_m.y() * m.x(), -by_m.dot(side)};
  }

 private:
  static constexpr double kMostAcross = 0.975;  ///< of the reach: beyond it the rim is steep
  static constexpr double kParallel = 1e-9;     ///< cosine to a face that the line never meets

  /// In the square's own axes; turning on by da changes it by da * (y, -x).
  Eigen::Vector2d Turned(const Eigen::Vector2d& v) const {
    return {cos_ * v.x() + sin_ * v.y(), cos_ * v.y() - sin_ * v.x()};
  }
  static Eigen::Vector2d Signs(const Eigen::Vector2d& m) {
    return {std::copysign(1.0, m.x()), std::copysign(1.0, m.y())};
  }

  PlanLength RoundChord(double across, double far) const {
    const double chord = std::sqrt(half_ * half_ - across * across);
    return {far * chord, -far * across / chord, 0.0, far * half_ / chord};
  }

  /// The nearer of the two faces ahead, or the farther of those behind.
  PlanLength SquareChord(const Eigen::Vector2d& d, double across, double far) const {
    const Eigen::Vector2d along = Turned(d), left = Turned({-d.y(), d.x()});
    PlanLength best{far * std::numeric_limits<double>::infinity()};
    for (int i = 0; i < 2; ++i) {
      const double turn = i == 0 ? 1.0 : -1.0;  // d(along[i])/d(yaw) = turn * along[1 - i]
      if (std::abs(along[i]) < kParallel) continue;
      const double face = far * std::copysign(1.0, along[i]);
      const double t = (face * half_ + across * left[i]) / along[i];
      if (far * (t - best.value) >= 0.0) continue;
      best = {t, left[i] / along[i], turn * (across * left[1 - i] - t * along[1 - i]) / along[i],
              face / along[i]};
    }
    return best;
  }

  bool square_;
  double half_, cos_, sin_;
};

}  // namespace chase::perception
