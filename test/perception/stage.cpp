#include "stage.h"

#include <algorithm>
#include <cmath>

#include "common/world/random.h"
#include "services/simulator/actors.h"

namespace chase::perception_stage {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Solid;

constexpr double kTurn = 2.0 * M_PI;
constexpr double kLevelled = 0.5;  // s that the rail is smoothed over, to either side
constexpr int kSmoothing = 24;     // samples of that
constexpr double kGravity = 9.81;
constexpr double kBraking = 4.0;      // m/s^2, of the drone before the target's start
constexpr double kScreenTime = 2.6;   // s that a screen takes from side to side
constexpr double kScreenReach = 3.2;  // m, where it starts and ends beside the line of sight
constexpr uint64_t kStream = 77;

/// Kinds of things in the target's colour.
enum Decoy { kTall, kLow, kThin, kBall, kTwin, kDecoys };

bool Free(const std::vector<Solid>& solids, const Vector3d& p, double radius) {
  return std::all_of(solids.begin(), solids.end(),
                     [&](const Solid& s) { return world::SignedDistance(s, p) > radius; });
}

}  // namespace

Stage::Stage(const StageOptions& options)
    : options_(options),
      scenario_(world::LoadScenario(options.scenario)),
      path_(world::TargetMotion(scenario_)) {
  world::Random random(options.seed, kStream);
  const bool fast = scenario_.target.speed > 2.0;
  start_ = random.Uniform(0.0, std::max(0.0, path_.Duration() - options.duration));
  base_delay_ = fast ? random.Uniform(1.3, 2.0) : random.Uniform(2.4, 4.2);
  delay_swing_ = fast ? 0.5 : 0.9;
  sway_ = fast ? 0.6 : 0.25;
  rise_ = fast ? random.Uniform(0.6, 1.1) : random.Uniform(0.4, 0.8);
  for (double& phase : phase_) phase = random.Uniform(0.0, kTurn);
  if (options.warm && options.seed % 2) light_ = {1.08, 0.92, 0.72};
  if (scenario_.world.forest.count > 0)
    scenario_.world.forest.seed = static_cast<int>(options.seed);
  if (options.screens) AddScreens();
  if (options.distractors) AddDistractors();
}

double Stage::Delay(double t) const {
  return base_delay_ + delay_swing_ * std::sin(0.45 * t + phase_[0]);
}

/// Where the target was some seconds ago; before that straight back from its start, where the drone
/// comes to a stop as the target starts from one: no step of the speed, which nothing flies.
Vector2d Stage::Rail(double t) const {
  const double s = start_ + t - Delay(t);
  if (s >= 0.0) return path_.Position(s);
  const Vector2d ahead = (path_.Position(1.0) - path_.Position(0.0)).normalized();
  const double v = scenario_.target.speed, braking = v / kBraking;  // s
  const double back = -s < braking ? 0.5 * kBraking * s * s : v * (-s - 0.5 * braking);
  return path_.Position(0.0) - back * ahead;
}

Vector2d Stage::Smooth(double t) const {
  Vector2d sum = Vector2d::Zero();
  for (int i = 0; i < kSmoothing; ++i)
    sum += Rail(t + kLevelled * (2.0 * (i + 0.5) / kSmoothing - 1.0));
  const Vector2d aside(std::sin(0.8 * t + phase_[1]), std::sin(0.7 * t + phase_[2]));
  return sum / kSmoothing + 0.7 * sway_ * aside;
}

Stage::Body Stage::BodyAt(double t) const {
  const double h = 0.02;
  const Vector2d p = Smooth(t), a = (Smooth(t + h) - 2.0 * p + Smooth(t - h)) / (h * h);
  const Vector2d sight = path_.Position(start_ + t) - p;
  const double floor = world::GroundHeight(scenario_.world.ground, p.x(), p.y());
  const double target = scenario_.target.base + 0.5 * scenario_.target.height;
  const double heading = std::atan2(sight.y(), sight.x()) + 0.12 * std::sin(0.9 * t + phase_[3]);
  const Vector3d up =
      Vector3d(std::clamp(a.x(), -4.0, 4.0), std::clamp(a.y(), -4.0, 4.0), kGravity).normalized();
  const Vector3d ahead(std::cos(heading), std::sin(heading), 0.0);
  Eigen::Matrix3d R;
  R.col(2) = up;
  R.col(1) = up.cross(ahead).normalized();
  R.col(0) = R.col(1).cross(up);
  return {{p.x(), p.y(), floor + target + rise_ + 0.25 * std::sin(0.6 * t + phase_[2])},
          Eigen::Quaterniond(R)};
}

/// Two screens that cross the line of sight and hide all of the target for a second or so.
void Stage::AddScreens() {
  for (const double share : {0.35, 0.75}) {
    const double from = share * options_.duration, to = from + kScreenTime;
    const auto middle = [&](double t) {
      return Vector2d(0.45 * Smooth(t) + 0.55 * path_.Position(start_ + t));
    };
    const Vector2d sight = (path_.Position(start_ + from) - Smooth(from)).normalized();
    const Vector2d aside(-sight.y(), sight.x());
    const Vector2d a = middle(from) + kScreenReach * aside, b = middle(to) - kScreenReach * aside;
    world::MoverSpec screen;
    screen.size = {1.9, 0.06, 3.2};
    screen.waypoints = {{a.x(), a.y(), 1.4}, {b.x(), b.y(), 1.4}};
    screen.start_time = start_ + from;
    screen.speed = (b - a).norm() / kScreenTime;
    scenario_.movers.push_back(screen);
  }
}

/// Things of the target's colour beside its way: taller, lower, thinner, round, and one just alike.
void Stage::AddDistractors() {
  world::Random random(options_.seed, kStream + 1);
  const auto& target = scenario_.target;
  std::vector<Solid> solids = world::StaticSolids(scenario_);
  const double keep = target.speed > 2.0 ? 1.6 : 0.75;
  const auto clear = [&](const Vector2d& p) {
    for (double t = -5.0; t < options_.duration + 2.0; t += 0.1)
      if ((path_.Position(start_ + t) - p).norm() < keep || (Smooth(t) - p).norm() < keep)
        return false;
    return Free(solids, {p.x(), p.y(), 0.5}, 0.5);
  };
  for (int kind = 0, tries = 0; kind < kDecoys && tries < 4000; ++tries) {
    const double t = random.Uniform(0.0, options_.duration), reach = keep + 2.5;
    const Vector2d p = path_.Position(start_ + t) +
                       Vector2d(random.Uniform(-reach, reach), random.Uniform(-reach, reach));
    if (!clear(p)) continue;
    Solid solid;
    if (kind == kTall) {
      scenario_.world.cylinders.push_back({p, 0.3, 1.3, 0.0});
    } else if (kind == kLow) {
      scenario_.world.boxes.push_back({{p.x(), p.y(), 0.2}, {0.7, 0.5, 0.4}, 20.0});
    } else if (kind == kThin) {
      scenario_.world.cylinders.push_back({p, 0.06, 0.3, 0.3});
    } else if (kind == kBall) {
      scenario_.world.ellipsoids.push_back({{p.x(), p.y(), 0.35}, {0.35, 0.35, 0.35}, 0.0});
    } else {
      const double z = target.base + world::GroundHeight(scenario_.world.ground, p.x(), p.y());
      scenario_.world.cylinders.push_back({p, target.radius, target.height, z});
    }
    if (kind == kLow)
      solid = {Solid::Kind::kBox, {p.x(), p.y(), 0.2}, {0.35, 0.25, 0.2}, 20.0 * M_PI / 180.0};
    else if (kind == kBall)
      solid = {Solid::Kind::kEllipsoid, {p.x(), p.y(), 0.35}, Vector3d::Constant(0.35), 0.0};
    else {
      const auto& c = scenario_.world.cylinders.back();
      solid = {Solid::Kind::kCylinder,
               {p.x(), p.y(), c.base + 0.5 * c.height},
               {c.radius, c.radius, 0.5 * c.height},
               0.0};
    }
    if (kind == kTwin && options_.absent) {
      scenario_.world.cylinders.pop_back();
      break;
    }
    solids.push_back(solid);
    orange_.push_back(solid);
    ++kind;
  }
}

}  // namespace chase::perception_stage
