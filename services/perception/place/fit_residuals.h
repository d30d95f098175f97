#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>

namespace chase::perception {

// Residuals over y = (p_WT, v_WT, yaw) [m, m/s, rad] and their derivatives by y.

using Vector7d = Eigen::Matrix<double, 7, 1>;
using Matrix7d = Eigen::Matrix<double, 7, 7>;
inline constexpr int kYawAt = 6;  ///< in y

struct Residual {
  double value = 0.0;
  Vector7d by_y = Vector7d::Zero();

  Residual Scaled(double scale) const { return {scale * value, scale * by_y}; }
};

/// A length in the plan view and its derivatives by how far the line passes the centre and by yaw.
struct PlanLength {
  double value, by_place = 0.0, by_yaw = 0.0;
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
    if (!square_) return {half_};
    const Eigen::Vector2d m = Turned(n), side = Signs(m);
    return {half_ * m.lpNorm<1>(), 0.0, half_ * (side.x() * m.y() - side.y() * m.x())};
  }

  /// Where a line along the unit vector d leaves it (far: +1) or enters it (-1), along d from the
  /// foot of the centre, which stands `across` to the left of the line. A line that passes beside
  /// it, or nearly, counts as the outermost that still crosses it well.
  PlanLength Chord(const Eigen::Vector2d& d, double across, double far) const {
    const PlanLength reach = Reach({-d.y(), d.x()});
    const auto chord = [&](double at) {
      return square_ ? SquareChord(d, at, far) : RoundChord(at, far);
    };
    if (std::abs(across) < kMostAcross * reach.value) return chord(across);
    const double most = std::copysign(kMostAcross, across);
    PlanLength end = chord(most * reach.value);
    end.by_yaw += most * end.by_place * reach.by_yaw;
    end.by_place = 0.0;
    return end;
  }

  /// Signed distance of q from it [m], negative inside; `by_q` the derivative.
  PlanLength Distance(const Eigen::Vector2d& q, Eigen::Vector2d* by_q) const {
    if (!square_) {
      const double from_axis = std::sqrt(q.squaredNorm() + 1e-12);
      *by_q = q / from_axis;
      return {from_axis - half_};
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
    return {distance, 0.0, by_m.x() * m.y() - by_m.y() * m.x()};
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
    return {far * chord, -far * across / chord};
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
      best = {t, left[i] / along[i], turn * (across * left[1 - i] - t * along[1 - i]) / along[i]};
    }
    return best;
  }

  bool square_;
  double half_, cos_, sin_;
};

/// A line of sight in the plan view: it leaves the camera at c_xy towards the unit vector d_xy and
/// climbs `slope` metres a metre.
struct PlanRay {
  Eigen::Vector3d c;          ///< p_WC, frame W, m
  Eigen::Vector2d direction;  ///< unit, frame W
  double slope = 0.0;

  double Along(const Vector7d& y) const { return direction.dot(y.head<2>() - c.head<2>()); }
  /// Positive where the axis stands to the left of the line of sight.
  double Across(const Vector7d& y) const {
    return direction.x() * (y[1] - c.y()) - direction.y() * (y[0] - c.x());
  }
  Eigen::Vector2d AcrossGradient() const { return {-direction.y(), direction.x()}; }
};

/// The target's solid by its size [m]: of a sphere the radius counts.
struct Solid {
  bool square;
  double half, height;

  Footprint At(const Vector7d& y) const { return {square, half, y[kYawAt]}; }
};

/// The line of sight touches the side of the target [m]: in the plan view the axis passes it at the
/// footprint's reach, to the right of a left edge (sign -1), to the left of a right edge (+1).
inline Residual SideResidual(const PlanRay& ray, const Solid& solid, double sign,
                             const Vector7d& y) {
  const Eigen::Vector2d left = ray.AcrossGradient();
  const PlanLength reach = solid.At(y).Reach(left);
  Residual r{sign * ray.Across(y) - reach.value};
  r.by_y.head<2>() = sign * left;
  r.by_y[kYawAt] = -reach.by_yaw;
  return r;
}

/// The line of sight touches the rim of the top (sign +1) or bottom (-1) [m]. Seen from above, the
/// top's outline is its far rim and the bottom's its near rim; seen from below the other way round.
inline Residual CapResidual(const PlanRay& ray, const Solid& solid, double sign,
                            const Vector7d& y) {
  const double rim = y[2] + sign * 0.5 * solid.height;
  const double far = (ray.c.z() > rim) == (sign > 0.0) ? 1.0 : -1.0;
  const PlanLength end = solid.At(y).Chord(ray.direction, ray.Across(y), far);
  Residual r{ray.c.z() + ray.slope * (ray.Along(y) + end.value) - rim};
  r.by_y.head<2>() = ray.slope * (ray.direction + end.by_place * ray.AcrossGradient());
  r.by_y[2] = -1.0;
  r.by_y[kYawAt] = ray.slope * end.by_yaw;
  return r.Scaled(sign);
}

/// The line of sight touches a sphere [m]: its centre passes it at one radius, on the inner side of
/// the edge: left or right (`upright`, -1 or +1), bottom or top (-1 or +1).
inline Residual TangentResidual(const PlanRay& ray, const Solid& solid, bool upright, double sign,
                                const Vector7d& y) {
  const Eigen::Vector3d sight =
      Eigen::Vector3d(ray.direction.x(), ray.direction.y(), ray.slope).normalized();
  const Eigen::Vector3d to_center = y.head<3>() - ray.c;
  const Eigen::Vector3d off = to_center - to_center.dot(sight) * sight;
  const double side = upright ? ray.Across(y) : ray.c.z() + ray.slope * ray.Along(y) - y[2];
  const double inner = sign * side < 0.0 ? -1.0 : 1.0;
  const double distance = std::sqrt(off.squaredNorm() + 1e-12);
  Residual r{inner * distance - solid.half};
  r.by_y.head<3>() = inner / distance * off;
  return r;
}

/// Distance of a LiDAR point [m] from a sphere's surface where it was `age` s before.
inline Residual SpherePointResidual(const Eigen::Vector3d& p_W, double age, const Solid& solid,
                                    const Vector7d& y) {
  const Eigen::Vector3d q = p_W - (y.head<3>() - age * y.segment<3>(3));
  const double distance = std::sqrt(q.squaredNorm() + 1e-12);
  Residual r{distance - solid.half};
  r.by_y << -q / distance, age * q / distance, 0.0;
  return r;
}

/// Distance of a LiDAR point [m] from the target's surface where it stood `age` s before.
inline Residual PointResidual(const Eigen::Vector3d& p_W, double age, const Solid& solid,
                              const Vector7d& y) {
  const Eigen::Vector3d q = p_W - (y.head<3>() - age * y.segment<3>(3));
  Eigen::Vector2d by_place;
  const PlanLength side = solid.At(y).Distance(q.head<2>(), &by_place);
  const double cap = std::abs(q.z()) - 0.5 * solid.height;
  const bool corner = side.value > 0.0 && cap > 0.0;
  const double distance =
      corner ? std::sqrt(side.value * side.value + cap * cap) : std::max(side.value, cap);
  const double by_side = corner ? side.value / distance : side.value > cap ? 1.0 : 0.0;
  const double by_cap = corner ? cap / distance : side.value > cap ? 0.0 : 1.0;
  Eigen::Vector3d by_q;
  by_q << by_side * by_place, by_cap * (q.z() < 0.0 ? -1.0 : 1.0);
  Residual r{distance};
  r.by_y << -by_q, age * by_q, by_side * side.by_yaw;
  return r;
}

}  // namespace chase::perception
