#include "services/planning/whereabouts.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

#include "common/world/shapes.h"

namespace chase::planning {
namespace {

constexpr uint32_t kHypotheses = 400;
constexpr double kStep = 0.1;        // s
constexpr double kMissed = 0.75;     // of what is in the image for a step, not found
constexpr double kFarthest = 15.0;   // m, from which a target is still found
constexpr double kLeastSpeed = 0.8;  // m/s: one that stood may set off
constexpr double kFaster = 1.25;     // than it was
constexpr double kStraight = 1.5;    // s between turns, about
constexpr double kRoams = 10.0;      // m from where it was last known, before it turns back
constexpr double kBody = 0.2;        // m that the target keeps from what stands, at least
constexpr double kReaction = 0.4;    // s before a turn shows anything
constexpr double kMostBack = 10.0;   // s that are gone through after a time without a search,
constexpr double kMostSteps = 20.0;  // in so many steps, so that it takes its time at most
constexpr int kHeadings = 36;
constexpr double kEnough = 0.3;  // effective share of the hypotheses, else new ones

double Wrapped(double angle) { return std::remainder(angle, 2.0 * M_PI); }

/// Number k of hypothesis i: additive recurrences by two irrational numbers, in [0,1).
double Uniform(uint32_t i, uint32_t k) {
  const double x = 0.5 + 0.7548776662466927 * i + 0.5698402909980532 * k;
  return x - std::floor(x);
}

/// An obstacle at one instant, in axes of its own.
struct Solid {
  Eigen::Vector3d center;
  Eigen::Matrix3d axes;  // columns, frame W
  world::Solid shape;
};

Solid SolidAt(double t, const world::Obstacle& o) {
  using Kind = world::Solid::Kind;
  const Eigen::Vector3d center = o.center.Position(t), origin = Eigen::Vector3d::Zero();
  if (o.solid == world::Obstacle::Solid::kBox)
    return {center, o.axes.toRotationMatrix(), {Kind::kBox, origin, o.half}};
  if (o.solid == world::Obstacle::Solid::kCylinder)
    return {center, Eigen::Matrix3d::Identity(), {Kind::kCylinder, origin, o.half}};
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(o.shape);
  return {center,
          eigen.eigenvectors(),
          {Kind::kEllipsoid, origin, eigen.eigenvalues().cwiseSqrt().cwiseInverse()}};
}

std::vector<Solid> SolidsAt(double t, const std::vector<world::Obstacle>& obstacles) {
  std::vector<Solid> solids;
  for (const world::Obstacle& o : obstacles)
    if (!o.ground) solids.push_back(SolidAt(t, o));
  return solids;
}

bool Cuts(const std::vector<Solid>& solids, const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::any_of(solids.begin(), solids.end(), [&](const Solid& s) {
    return world::SegmentHits(s.shape, s.axes.transpose() * (a - s.center),
                              s.axes.transpose() * (b - s.center));
  });
}

}  // namespace

void Whereabouts::Redirect(uint32_t number, double t, double spread, Hypothesis* h) const {
  const double turn = 2.0 * Uniform(number, h->draws) - 1.0;
  const Eigen::Vector2d back = origin_ - h->p;
  if (back.norm() > kRoams) h->heading = std::atan2(back.y(), back.x());
  h->heading += spread * turn * std::abs(turn);  // mostly it goes on
  h->speed = top_speed_ * (0.2 + 0.8 * Uniform(number, h->draws + 1));
  h->turns_at = t + kStraight * (0.5 + Uniform(number, h->draws + 2));
  h->draws += 3;
}

void Whereabouts::Begin(double t, const Eigen::Vector3d& p, const Eigen::Vector3d& v,
                        double fastest) {
  t_ = t;
  origin_ = p.head<2>();
  height_ = p.z();
  top_speed_ = kFaster * std::max({kLeastSpeed, fastest, v.head<2>().norm()});
  hypotheses_.clear();
  for (uint32_t i = 0; i < kHypotheses; ++i) {
    Hypothesis h{p.head<2>(), std::atan2(v.y(), v.x()), 0.0, 0.0, 1.0 / kHypotheses, 0};
    Redirect(i, t, M_PI, &h);
    hypotheses_.push_back(h);
  }
}

void Whereabouts::Advance(double t, const std::vector<world::Obstacle>& obstacles,
                          const Eigen::Vector3d& eye, double yaw, const View& view) {
  t_ = std::max(t_, t - kMostBack);
  const double step = std::max(kStep, (t - t_) / kMostSteps);
  while (t_ + step <= t) {
    Move(t_, step, obstacles);
    t_ += step;
    Look(t_, obstacles, eye, yaw, view);
    Resample();
  }
}

void Whereabouts::Move(double t, double dt, const std::vector<world::Obstacle>& obstacles) {
  const std::vector<Solid> solids = SolidsAt(t, obstacles);
  for (uint32_t i = 0; i < hypotheses_.size(); ++i) {
    Hypothesis& h = hypotheses_[i];
    if (t >= h.turns_at) Redirect(i, t, M_PI_2, &h);
    const Eigen::Vector2d way(std::cos(h.heading), std::sin(h.heading));
    const Eigen::Vector2d to = h.p + dt * h.speed * way, front = to + kBody * way;
    const Eigen::Vector3d from3(h.p.x(), h.p.y(), height_), to3(front.x(), front.y(), height_);
    const bool inside = Cuts(solids, from3, from3);  // then anywhere out of it
    if (!inside && Cuts(solids, from3, to3))
      Redirect(i, t, 2.0 * M_PI, &h);
    else
      h.p = to;
  }
}

void Whereabouts::Look(double t, const std::vector<world::Obstacle>& obstacles,
                       const Eigen::Vector3d& eye, double yaw, const View& view) {
  const std::vector<Solid> solids = SolidsAt(t, obstacles);
  const bool around = !(view.side > 0.0);
  double sum = 0.0;
  for (Hypothesis& h : hypotheses_) {
    const Eigen::Vector3d p(h.p.x(), h.p.y(), height_);
    const Eigen::Vector2d way = h.p - eye.head<2>();
    const double distance = std::max(way.norm(), 1e-6), below = (eye.z() - height_) / distance;
    h.bearing = std::atan2(way.y(), way.x());
    const bool level = around || (below < view.down && below > -view.up);
    h.in_sight = level && distance < kFarthest && !Cuts(solids, eye, p);
    const double off = std::abs(Wrapped(h.bearing - yaw));
    if (h.in_sight && (around || off < std::atan(view.side))) h.weight *= kMissed;
    sum += h.weight;
  }
  for (Hypothesis& h : hypotheses_) h.weight /= sum;
}

/// Systematic: those of much weight are doubled, and go their own ways from there.
void Whereabouts::Resample() {
  double squares = 0.0;
  for (const Hypothesis& h : hypotheses_) squares += h.weight * h.weight;
  const auto n = static_cast<double>(hypotheses_.size());
  if (1.0 / squares > kEnough * n) return;
  std::vector<Hypothesis> next;
  double reached = 0.0;
  for (const Hypothesis& h : hypotheses_) {
    reached += h.weight;
    while (static_cast<double>(next.size()) + 0.5 < reached * n) {
      next.push_back(h);
      next.back().weight = 1.0 / n;
      next.back().turns_at =
          std::min(h.turns_at, t_ + kStraight * Uniform(static_cast<uint32_t>(next.size()), 0));
    }
  }
  while (next.size() < hypotheses_.size()) next.push_back(next.back());
  hypotheses_ = std::move(next);
}

Whereabouts::Gaze Whereabouts::BestGaze(double yaw, double rate, const View& view) const {
  std::array<double, kHeadings> mass{};
  Gaze gaze{yaw, 0.0};
  for (const Hypothesis& h : hypotheses_) {
    if (!h.in_sight) continue;
    gaze.share += h.weight;
    const double bin = (Wrapped(h.bearing) / (2.0 * M_PI) + 1.0) * kHeadings;
    mass[static_cast<size_t>(bin) % kHeadings] += h.weight;
  }
  const double half = view.side > 0.0 ? std::atan(view.side) : M_PI;
  double best = 0.0;
  for (int k = 0; k < kHeadings; ++k) {
    const double heading = Wrapped((k + 0.5) * 2.0 * M_PI / kHeadings);
    double shown = 0.0;
    for (int j = 0; j < kHeadings; ++j) {
      const double bearing = (j + 0.5) * 2.0 * M_PI / kHeadings;
      const double off = std::abs(Wrapped(bearing - heading));
      if (off < half) shown += mass[static_cast<size_t>(j)] * (1.0 - 0.5 * off / half);
    }
    const double worth = shown / (kReaction + std::abs(Wrapped(heading - yaw)) / rate);
    if (worth > best) best = worth, gaze.yaw = heading;
  }
  return gaze;
}

Eigen::Vector3d Whereabouts::Likeliest(double radius) const {
  double best = -1.0;
  Eigen::Vector2d place = Eigen::Vector2d::Zero();
  for (const Hypothesis& h : hypotheses_) {
    double sum = 0.0;
    Eigen::Vector2d mean = Eigen::Vector2d::Zero();
    for (const Hypothesis& other : hypotheses_)
      if ((other.p - h.p).squaredNorm() < radius * radius)
        sum += other.weight, mean += other.weight * other.p;
    if (sum > best) best = sum, place = mean / std::max(sum, 1e-12);
  }
  return {place.x(), place.y(), height_};
}

}  // namespace chase::planning
