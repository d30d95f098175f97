#include "stage.h"

#include <algorithm>
#include <cmath>

namespace chase::mapping_stage {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kStep = 0.01;         // s between poses
constexpr double kSweep = 0.1;         // s
constexpr double kMoverStep = 5e-4;    // s for which movers stay where they are
constexpr double kOnSurface = 0.03;    // m, a return this near to a solid hit it
constexpr double kBin = 3.0;           // m
constexpr int kBins = 512;             // to a side
constexpr double kEstimateAge = 0.05;  // s
constexpr double kClaimedSigma = 0.1;  // m
constexpr uint64_t kStream = 91;

size_t BinOf(double x, double y) {
  const auto wrap = [](double v) { return static_cast<int>(std::floor(v / kBin)) & (kBins - 1); };
  return static_cast<size_t>(wrap(x) * kBins + wrap(y));
}

simulator::LidarConfig Exact() {
  simulator::LidarConfig config;
  config.noise = 0.0;  // the stage adds its own, so that it knows the true places
  return config;
}

world::Rig Centred() {
  world::Rig rig;
  rig.lidar_position.setZero();
  rig.lidar_rpy_deg.setZero();
  return rig;
}

}  // namespace

Stage::Stage(const Course& course, const Errors& errors, uint64_t seed)
    : course_(course),
      errors_(errors),
      solids_(world::StaticSolids(course.scenario)),
      bins_(kBins * kBins),
      actors_(course.scenario),
      scene_(course.scenario),
      lidar_(Exact(), Centred(), seed),
      random_(seed, kStream) {
  for (size_t i = 0; i < solids_.size(); ++i) {
    const auto& s = solids_[i];
    const double reach = s.half_size.head<2>().norm() + kBin;
    for (double x = s.center.x() - reach; x < s.center.x() + reach + kBin; x += kBin)
      for (double y = s.center.y() - reach; y < s.center.y() + reach + kBin; y += kBin)
        bins_[BinOf(x, y)].push_back(static_cast<int>(i));
  }
}

const std::vector<int>& Stage::Near(double x, double y) const { return bins_[BinOf(x, y)]; }

simulator::TimedPose Stage::Pose(double t) const {
  const double h = 0.05;
  const Vector3d v = (course_.place(t + h) - course_.place(t - h)) / (2.0 * h);
  const double yaw = v.head<2>().norm() > 1e-3 ? std::atan2(v.y(), v.x()) : 0.0;
  const Eigen::Quaterniond q = Eigen::AngleAxisd(yaw, Vector3d::UnitZ()) *
                               Eigen::AngleAxisd(0.10 * std::sin(0.9 * t), Vector3d::UnitY()) *
                               Eigen::AngleAxisd(0.08 * std::sin(0.7 * t + 1.0), Vector3d::UnitX());
  return {t, course_.place(t), q};
}

void Stage::Classify(const Vector3d& p, double t, std::vector<Hit>* hits) {
  Hit hit{p};
  hit.t = t;
  double best = kOnSurface;
  for (const int i : Near(p.x(), p.y())) {
    const double d = std::abs(world::SignedDistance(solids_[static_cast<size_t>(i)], p));
    if (d < best) best = d, hit.solid = i;
  }
  if (std::abs(t - movers_t_) > kMoverStep) {
    movers_ = actors_.Movers(Actual(t));
    movers_t_ = t;
  }
  for (size_t i = 0; i < movers_.size(); ++i) {
    const double d = std::abs(world::SignedDistance(movers_[i].solid, p));
    if (d < best) best = d, hit.solid = -1, hit.mover = static_cast<int>(i);
  }
  if (hit.solid >= 0 || hit.mover >= 0) hits->push_back(hit);
}

void Stage::Observe(Shot* shot) {
  const double t = t_ - kEstimateAge;
  const double phase = course_.blind > 0.0 ? std::fmod(t, course_.blind_period) : 0.0;
  if (course_.frozen || phase > course_.blind_period - course_.blind) return;
  const auto truth = actors_.Target(t);
  mapping::TargetEstimate estimate;
  estimate.t = t;
  estimate.mean = truth.center;
  estimate.velocity = truth.velocity;
  for (int i = 0; i < 3; ++i) {
    estimate.mean[i] += errors_.target * random_.Gaussian();
    estimate.velocity[i] += 2.0 * errors_.target * random_.Gaussian();
  }
  estimate.sigma = kClaimedSigma;
  estimate.radius = course_.scenario.target.radius;
  estimate.height = course_.scenario.target.height;
  shot->target = estimate;
}

std::optional<Shot> Stage::Next() {
  std::optional<simulator::Sweep> measured;
  while (!measured) {
    if (t_ >= course_.duration) return std::nullopt;
    scene_.MoveTo(Actual(t_));
    if (rail_.empty()) rail_.push_back(Pose(t_));
    rail_.push_back(Pose(t_ + kStep));
    lidar_.Advance({rail_[rail_.size() - 2], rail_.back()}, scene_);
    t_ += kStep;
    measured = lidar_.Take();
  }
  Shot shot;
  const auto end = rail_.back();
  shot.place = end.p;
  shot.true_target = actors_.Target(Actual(t_));
  shot.movers = actors_.Movers(Actual(t_));
  shot.sweep.t = t_;
  Vector3d error;
  for (int i = 0; i < 3; ++i) error[i] = errors_.pose * random_.Gaussian();
  shot.sweep.origin = end.p + error;
  const Eigen::AngleAxisd turn(errors_.yaw * random_.Gaussian(), Vector3d::UnitZ());
  for (size_t i = 0; i < measured->x.size(); ++i) {
    const double fired = measured->start + measured->t[i];
    const size_t step = std::min(rail_.size() - 2, static_cast<size_t>(fired / kStep));
    const auto pose = simulator::Interpolated(rail_[step], rail_[step + 1], fired);
    const Vector3d ray(measured->x[i], measured->y[i], measured->z[i]);
    const double noise = errors_.range * random_.Gaussian();
    const Vector3d point = pose.p + pose.q * ray,
                   seen = point + noise * (pose.q * ray.normalized());
    shot.sweep.points.push_back((shot.sweep.origin + turn * (seen - end.p)).cast<float>());
    if ((point - end.p).norm() < 20.0) Classify(point, pose.t, &shot.hits);
  }
  const Eigen::Quaterniond heading(turn * end.q);
  shot.sweep.axis = heading * Vector3d::UnitZ();
  shot.sweep.ages = mapping::FiringAges(shot.sweep.origin, heading, shot.sweep.points, kSweep);
  Observe(&shot);
  return shot;
}

Course Follow(const std::string& file, double delay, double height) {
  Course course;
  course.scenario = world::LoadScenario(file);
  course.name = course.scenario.name;
  course.duration = course.scenario.duration_s;
  const auto path = world::TargetMotion(course.scenario);
  const double speed = course.scenario.target.speed;
  const auto rail = [path, delay, speed](double t) -> Vector2d {
    const double s = t - delay;
    if (s >= 0.0) return path.Position(s);
    return path.Position(0.0) + speed * s * (path.Position(1.0) - path.Position(0.0)).normalized();
  };
  const auto ground = course.scenario.world.ground;
  course.place = [rail, ground, height](double t) -> Vector3d {
    Vector2d p = Vector2d::Zero();
    for (int i = 0; i < 8; ++i) p += 0.125 * rail(t + 0.1 * (i - 3.5));
    return {p.x(), p.y(),
            world::GroundHeight(ground, p.x(), p.y()) + height + 0.25 * std::sin(0.6 * t)};
  };
  for (const auto& wall : course.scenario.world.walls) {
    if (course.low.x() < -1e8) course.low = course.high = wall.from;
    for (const Vector2d& end : {wall.from, wall.to}) {
      course.low = course.low.cwiseMin(end);
      course.high = course.high.cwiseMax(end);
    }
  }
  return course;
}

Course Crossing(double speed) {
  Course course;
  course.name = "crossing";
  auto& s = course.scenario;
  s.target.waypoints = {{-30.0, -30.0}, {-30.0, -29.0}};
  // The trunk at (4, 0.3) hides part of both movers on their ways.
  for (const Vector2d& c : {Vector2d(4.0, 0.3), Vector2d(12.0, -5.0), Vector2d(12.0, 1.0),
                            Vector2d(12.0, 6.0), Vector2d(-5.0, -4.0), Vector2d(-5.0, 5.0)})
    s.world.cylinders.push_back({c, 0.3, 8.0, 0.0});
  for (const double x : {-20.0, 25.0}) s.world.boxes.push_back({{x, 0, 2}, {0.2, 60, 4}, 0.0});
  const double start = 3.0;
  world::MoverSpec first, second;
  first.size = {3.0, 1.2, 1.8};
  first.waypoints = {{8.0, -24.0, 1.0}, {8.0, 24.0, 1.0}};
  second.size = {2.2, 1.0, 1.8};
  second.waypoints = {{5.9, 24.0, 1.0}, {5.9, -24.0, 1.0}};
  first.speed = second.speed = speed;
  first.start_time = second.start_time = start;
  s.movers = {first, second};
  course.duration = start + 48.0 / speed + 3.0;
  course.place = [](double t) { return Vector3d(0.3 * std::sin(t), 0.4 * std::cos(0.5 * t), 1.5); };
  return course;
}

Course Traffic(uint64_t seed) {
  constexpr double kFirst = 6.0, kEvery = 4.0, kReach = 22.0;
  Course course = Follow("deploy/scenarios/forest.yaml", 1.4, 1.8);
  auto& s = course.scenario;
  const auto path = world::TargetMotion(s);
  world::Random random(seed, kStream + 1);
  s.world.forest.seed = static_cast<int>(100 + seed);
  s.movers.clear();
  for (double when = kFirst; when < course.duration - 6.0; when += kEvery) {
    world::MoverSpec mover;
    const char* const shapes[] = {"box", "box", "cylinder", "ellipsoid"};
    mover.shape = shapes[static_cast<int>(random.Uniform(0.0, 4.0)) & 3];
    const double length = random.Uniform(0.8, 3.5);
    const bool round = mover.shape == "cylinder";
    mover.size = {length, round ? length : random.Uniform(0.4, 0.8) * length, 1.7};
    mover.speed = random.Uniform(1.5, 4.0);
    // Its way cuts the target's path where the target is 2 to 3 s later.
    const double ahead = when + random.Uniform(2.0, 3.0), angle = random.Uniform(0.7, 2.4);
    const Vector2d course_there = path.Position(ahead + 0.1) - path.Position(ahead - 0.1);
    const double side = random.Uniform() < 0.5 ? -1.0 : 1.0;
    const Vector2d way = kReach * (Eigen::Rotation2Dd(side * angle) * course_there.normalized());
    const Vector2d from = path.Position(ahead) - way, to = path.Position(ahead) + way;
    mover.waypoints = {{from.x(), from.y(), 1.0}, {to.x(), to.y(), 1.0}};
    mover.start_time = when - kReach / mover.speed;
    s.movers.push_back(mover);
  }
  return course;
}

Course Long(double length) {
  constexpr double kPeriod = 60.0, kHalfWidth = 25.0, kSpeed = 5.0;
  constexpr int kTrees = 120;
  Course course;
  course.name = "long";
  auto& s = course.scenario;
  s.world.ground.roughness = 0.12;
  s.world.ground.wavelength = 10.0;
  s.target.waypoints = {{-40.0, -100.0}, {-40.0, -99.0}};
  world::Random random(4, kStream);
  std::vector<Vector2d> trees;
  while (trees.size() < kTrees) {
    const Vector2d p(random.Uniform(0.0, kPeriod), random.Uniform(-kHalfWidth, kHalfWidth));
    if (std::abs(p.y()) < 1.5) continue;
    if (std::all_of(trees.begin(), trees.end(),
                    [&](const Vector2d& o) { return (o - p).norm() > 2.8; }))
      trees.push_back(p);
  }
  for (double x = -kPeriod; x < length + kPeriod; x += kPeriod)
    for (const auto& p : trees) s.world.cylinders.push_back({{x + p.x(), p.y()}, 0.25, 7.0, -0.5});
  course.duration = length / kSpeed;
  course.frozen = true;
  course.place = [](double t) {
    return Vector3d(kSpeed * t, 0.6 * std::sin(0.5 * t), 1.8 + 0.2 * std::sin(0.6 * t));
  };
  return course;
}

}  // namespace chase::mapping_stage
