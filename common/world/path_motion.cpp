#include "common/world/path_motion.h"

#include <algorithm>
#include <cmath>

namespace chase::world {
namespace {

using Eigen::Vector2d;

constexpr double kStep = 0.02;  // s between the samples of a motion along waypoints

/// A straight line or an arc of constant curvature [1/m], positive to the left.
struct Piece {
  Vector2d start, direction;
  double length = 0.0, curvature = 0.0;

  Vector2d Tangent(double s) const {
    const double c = std::cos(curvature * s), n = std::sin(curvature * s);
    return {c * direction.x() - n * direction.y(), n * direction.x() + c * direction.y()};
  }
  Vector2d Position(double s) const {
    if (curvature == 0.0) return start + s * direction;
    const Vector2d left(-direction.y(), direction.x());
    return start + std::sin(curvature * s) / curvature * direction +
           (1.0 - std::cos(curvature * s)) / curvature * left;
  }
};

std::vector<Vector2d> WithoutRepeats(const std::vector<Vector2d>& waypoints) {
  std::vector<Vector2d> out;
  for (const auto& p : waypoints)
    if (out.empty() || (p - out.back()).norm() > 1e-9) out.push_back(p);
  return out;
}

double TurnAngle(const Vector2d& a, const Vector2d& b) {
  return std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
}

/// Lines joined by arcs of the given radius, smaller where a leg is too short for it.
std::vector<Piece> Pieces(const std::vector<Vector2d>& waypoints, double radius) {
  std::vector<Piece> pieces;
  Vector2d at = waypoints.front();
  for (std::size_t i = 1; i < waypoints.size(); ++i) {
    const Vector2d leg = waypoints[i] - waypoints[i - 1], direction = leg.normalized();
    double trim = 0.0, angle = 0.0;
    if (i + 1 < waypoints.size()) {
      const Vector2d next = waypoints[i + 1] - waypoints[i];
      angle = TurnAngle(leg, next);
      const double shorter = std::min(leg.norm(), next.norm());
      trim = std::min(radius * std::tan(0.5 * std::abs(angle)), 0.5 * shorter);
    }
    const Vector2d stop = waypoints[i] - trim * direction;
    pieces.push_back({at, direction, (stop - at).dot(direction), 0.0});
    if (trim > 1e-9) {
      const double curvature = std::tan(0.5 * std::abs(angle)) / trim * (angle > 0.0 ? 1.0 : -1.0);
      pieces.push_back({stop, direction, angle / curvature, curvature});
      at = pieces.back().Position(pieces.back().length);
    } else {
      at = stop;
    }
  }
  return pieces;
}

/// Path length and speed at time t of a motion from rest to rest over `length`.
struct Trapezoid {
  double length, speed, acceleration;

  double peak() const { return std::min(speed, std::sqrt(length * acceleration)); }
  double duration() const { return length / peak() + peak() / acceleration; }
  double SpeedAt(double t) const {
    const double ramp = std::min(t, duration() - t) * acceleration;
    return std::clamp(ramp, 0.0, peak());
  }
  double LengthAt(double t) const {
    const double v = peak(), ramp = v / acceleration, left = duration() - t;
    if (t <= 0.0) return 0.0;
    if (left <= 0.0) return length;
    if (t < ramp) return 0.5 * acceleration * t * t;
    if (left < ramp) return length - 0.5 * acceleration * left * left;
    return v * (t - 0.5 * ramp);
  }
};

}  // namespace

PathMotion::PathMotion(const std::vector<Vector2d>& waypoints, double speed, double acceleration,
                       double corner_radius) {
  const auto points = WithoutRepeats(waypoints);
  if (points.size() < 2) {
    t_ = {0.0};
    p_ = {points.empty() ? Vector2d::Zero() : points.front()};
    v_ = {Vector2d::Zero()};
    return;
  }
  const auto pieces = Pieces(points, corner_radius);
  double length = 0.0;
  for (const auto& piece : pieces) length += piece.length;
  const Trapezoid profile{length, speed, acceleration};
  const int steps = static_cast<int>(std::ceil(profile.duration() / kStep));
  std::size_t k = 0;
  double passed = 0.0;
  for (int i = 0; i <= steps; ++i) {
    const double t = std::min(i * kStep, profile.duration()), s = profile.LengthAt(t);
    while (k + 1 < pieces.size() && s > passed + pieces[k].length) passed += pieces[k++].length;
    t_.push_back(t);
    p_.push_back(pieces[k].Position(s - passed));
    v_.push_back(profile.SpeedAt(t) * pieces[k].Tangent(s - passed));
  }
}

PathMotion::PathMotion(const std::vector<Eigen::Vector3d>& samples) {
  for (const auto& sample : samples) {
    t_.push_back(sample.x());
    p_.emplace_back(sample.tail<2>());
  }
  const std::size_t n = p_.size();
  for (std::size_t i = 0; i < n; ++i) {
    const std::size_t a = i > 0 ? i - 1 : 0, b = std::min(i + 1, n - 1);
    const bool end = i == 0 || i + 1 == n;
    v_.push_back(end ? Vector2d(0.0, 0.0) : Vector2d((p_[b] - p_[a]) / (t_[b] - t_[a])));
  }
}

std::size_t PathMotion::Segment(double t) const {
  const auto after = std::upper_bound(t_.begin(), t_.end() - 1, t);
  return static_cast<std::size_t>(after - t_.begin()) - 1;
}

Vector2d PathMotion::Position(double t) const {
  if (t_.empty()) return Vector2d::Zero();
  if (t <= t_.front()) return p_.front();
  if (t >= t_.back()) return p_.back();
  const std::size_t i = Segment(t);
  const double h = t_[i + 1] - t_[i], s = (t - t_[i]) / h;
  return p_[i] + s * s * (3.0 - 2.0 * s) * (p_[i + 1] - p_[i]) +
         h * s * (1.0 - s) * ((1.0 - s) * v_[i] - s * v_[i + 1]);
}

Vector2d PathMotion::Velocity(double t) const {
  if (t_.empty() || t <= t_.front() || t >= t_.back()) return Vector2d::Zero();
  const std::size_t i = Segment(t);
  const double h = t_[i + 1] - t_[i], s = (t - t_[i]) / h;
  return 6.0 * s * (1.0 - s) / h * (p_[i + 1] - p_[i]) + (1.0 - s) * (1.0 - 3.0 * s) * v_[i] +
         s * (3.0 * s - 2.0) * v_[i + 1];
}

}  // namespace chase::world
