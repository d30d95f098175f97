#include "common/world/path_motion.h"

#include <algorithm>
#include <cmath>

#include "common/world/speed_profile.h"

namespace chase::world {
namespace {

using Eigen::Vector2d;

constexpr double kStep = 0.02;  // s between the samples of a motion along waypoints

/// A straight line or an arc of constant curvature [1/m], positive to the left.
struct Piece {
  Vector2d start, direction;
  double length = 0.0, curvature = 0.0;
  double rest = -1.0;  // s at its end, negative: none

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

/// A waypoint; the motion rests there for `rest` [s], or goes on when that is negative.
struct Waypoint {
  Vector2d p;
  double rest = -1.0;
};

std::vector<Waypoint> WithoutRepeats(const std::vector<Vector2d>& waypoints,
                                     const PathMotion::Stops& stops) {
  std::vector<Waypoint> out;
  for (std::size_t i = 0; i < waypoints.size(); ++i) {
    if (out.empty() || (waypoints[i] - out.back().p).norm() > 1e-9) out.push_back({waypoints[i]});
    for (const auto& [index, rest] : stops)
      if (index == static_cast<int>(i)) out.back().rest = std::max(out.back().rest, rest);
  }
  return out;
}

double TurnAngle(const Vector2d& a, const Vector2d& b) {
  return std::atan2(a.x() * b.y() - a.y() * b.x(), a.dot(b));
}

/// Lines joined by arcs of the given radius, smaller where a leg is too short for it. Where it
/// rests it turns on the spot.
std::vector<Piece> Pieces(const std::vector<Waypoint>& waypoints, double radius) {
  std::vector<Piece> pieces;
  Vector2d at = waypoints.front().p;
  for (std::size_t i = 1; i < waypoints.size(); ++i) {
    const Vector2d leg = waypoints[i].p - waypoints[i - 1].p, direction = leg.normalized();
    double trim = 0.0, angle = 0.0;
    if (i + 1 < waypoints.size() && waypoints[i].rest < 0.0) {
      const Vector2d next = waypoints[i + 1].p - waypoints[i].p;
      angle = TurnAngle(leg, next);
      const double shorter = std::min(leg.norm(), next.norm());
      trim = std::min(radius * std::tan(0.5 * std::abs(angle)), 0.5 * shorter);
    }
    const Vector2d stop = waypoints[i].p - trim * direction;
    pieces.push_back({at, direction, (stop - at).dot(direction), 0.0, waypoints[i].rest});
    if (trim > 1e-9) {
      const double curvature = std::tan(0.5 * std::abs(angle)) / trim * (angle > 0.0 ? 1.0 : -1.0);
      pieces.push_back({stop, direction, angle / curvature, curvature, -1.0});
      at = pieces.back().Position(pieces.back().length);
    } else {
      at = stop;
    }
  }
  return pieces;
}

/// What the pieces allow, joined where they allow the same.
std::vector<Stretch> Stretches(const std::vector<Piece>& pieces, const PathLimits& limits) {
  std::vector<Stretch> stretches;
  for (const Piece& piece : pieces) {
    const double bend = std::abs(piece.curvature);
    const double speed = limits.lateral > 0.0 && bend > 0.0
                             ? std::min(limits.speed, std::sqrt(limits.lateral / bend))
                             : limits.speed;
    const bool goes_on = !stretches.empty() && stretches.back().rest < 0.0;
    if (goes_on && (piece.length <= 0.0 || stretches.back().speed == speed)) {
      stretches.back().length += piece.length;
      stretches.back().rest = piece.rest;
    } else if (piece.length > 0.0) {
      stretches.push_back({piece.length, speed, piece.rest});
    }
  }
  return stretches;
}

/// Every kStep, at rests on the way, and at the end.
std::vector<double> SampleTimes(const SpeedProfile& profile) {
  std::vector<double> times;
  const int steps = static_cast<int>(std::ceil(profile.duration() / kStep));
  for (int i = 0; i <= steps; ++i) times.push_back(std::min(i * kStep, profile.duration()));
  times.insert(times.end(), profile.rests().begin(), profile.rests().end());
  std::sort(times.begin(), times.end());
  const auto repeats = [](double a, double b) { return b - a < 1e-9; };
  times.erase(std::unique(times.begin(), times.end(), repeats), times.end());
  return times;
}

}  // namespace

PathMotion::PathMotion(const std::vector<Vector2d>& waypoints, const PathLimits& limits,
                       double corner_radius, const Stops& stops) {
  const auto points = WithoutRepeats(waypoints, stops);
  if (points.size() < 2) {
    t_ = {0.0};
    p_ = {points.empty() ? Vector2d::Zero() : points.front().p};
    v_ = {Vector2d::Zero()};
    return;
  }
  const auto pieces = Pieces(points, corner_radius);
  const SpeedProfile profile(Stretches(pieces, limits), limits.acceleration,
                             std::max(0.0, points.front().rest));
  std::size_t k = 0;
  double passed = 0.0;
  for (const double t : SampleTimes(profile)) {
    const double s = profile.LengthAt(t);
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

Vector2d PathMotion::Direction(double t) const {
  if (t_.size() < 2) return Vector2d::Zero();
  const auto moves = [this](std::size_t i) { return v_[i].norm() > 1e-9; };
  const std::size_t now = Segment(std::clamp(t, t_.front(), t_.back()));
  for (std::size_t i = now + 1; i-- > 0;)
    if (moves(i)) return v_[i].normalized();
  for (std::size_t i = now; i < v_.size(); ++i)
    if (moves(i)) return v_[i].normalized();
  return Vector2d::Zero();
}

}  // namespace chase::world
