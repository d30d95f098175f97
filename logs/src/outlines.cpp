#include "logs/src/outlines.h"

#include <Eigen/Dense>
#include <cmath>

namespace chase::logs {
namespace {

using Eigen::Vector2d;

constexpr int kFanPoints = 16;
constexpr int kCirclePoints = 48;

Outline Sampled(const world::Trajectory& trajectory) {
  Outline out;
  for (int i = 0; i <= kFanPoints; ++i)
    out.push_back(
        trajectory.Position(trajectory.start + trajectory.duration * i / kFanPoints).head<2>());
  return out;
}

}  // namespace

void Fan::Add(double t, const world::Trajectory& trajectory) {
  if (thinner_.Pass(t)) outlines_.push_back(Sampled(trajectory));
}

Outline Ellipse(const Vector2d& c, const Eigen::Matrix2d& A) {
  Outline out;
  for (int i = 0; i < kCirclePoints; ++i) {
    const double a = 2 * M_PI * i / kCirclePoints;
    out.push_back(c + A * Vector2d(std::cos(a), std::sin(a)));
  }
  return out;
}

/// The xy block of the inverse of R.
std::vector<Outline> Shadows(const std::vector<PerceivedObstacle>& obstacles) {
  std::vector<Outline> shadows;
  for (const PerceivedObstacle& o : obstacles) {
    const Eigen::Matrix2d cov = o.shape.inverse().topLeftCorner<2, 2>();
    shadows.push_back(Ellipse(o.center.head<2>(), cov.llt().matrixL()));
  }
  return shadows;
}

nlohmann::ordered_json Points(const Outline& outline, bool closed) {
  nlohmann::ordered_json x = nlohmann::ordered_json::array(), y = x;
  const auto add = [&](const Vector2d& p) {
    x.push_back(std::round(p.x() * 1e3) / 1e3);
    y.push_back(std::round(p.y() * 1e3) / 1e3);
  };
  for (const Vector2d& p : outline) add(p);
  if (closed && !outline.empty()) add(outline.front());
  return {{"x", x}, {"y", y}};
}

nlohmann::ordered_json Points(const std::vector<Outline>& outlines, bool closed) {
  auto out = nlohmann::ordered_json::array();
  for (const Outline& o : outlines) out.push_back(Points(o, closed));
  return out;
}

}  // namespace chase::logs
