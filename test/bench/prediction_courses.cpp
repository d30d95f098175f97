#include "test/bench/prediction_courses.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "common/world/scenario.h"
#include "deploy/worlds/worlds.h"
#include "test/unit/prediction_instances.h"

namespace chase::prediction {
namespace {

using Eigen::Vector2d;

constexpr double kHigh = 20.0;                             // semi-axis of what is upright, m
constexpr double kWallPiece = 1.0;                         // m of wall per ellipsoid
constexpr int kSeen = 5, kForecast = 25, kFurthest = 250;  // steps of 10 ms

world::Obstacle Upright(const Vector2d& center, double a, double b, double yaw) {
  world::Obstacle o;
  o.center = world::Trajectory::Constant({center.x(), center.y(), 0.5}, 0.0, 1.0);
  const Eigen::Matrix3d R = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  o.shape = R * Eigen::Vector3d(1 / (a * a), 1 / (b * b), 1 / (kHigh * kHigh)).asDiagonal() *
            R.transpose();
  return o;
}

void AddWall(const world::WallSpec& wall, std::vector<world::Obstacle>* obstacles) {
  const Vector2d along = wall.to - wall.from;
  const int pieces = static_cast<int>(std::ceil(along.norm() / kWallPiece));
  for (int i = 0; i < pieces; ++i)
    obstacles->push_back(Upright(wall.from + (i + 0.5) / pieces * along, kWallPiece, wall.thickness,
                                 std::atan2(along.y(), along.x())));
}

std::vector<Vector2d> Sampled(const world::PathMotion& motion) {
  std::vector<Vector2d> truth;
  for (double t = 0.0; t <= motion.Duration(); t += 0.01) truth.push_back(motion.Position(t));
  return truth;
}

// Rows of three numbers below a line of headings.
std::vector<Eigen::Vector3d> ReadRows(const std::string& file) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error(file + ": cannot be read");
  std::vector<Eigen::Vector3d> rows;
  std::string line;
  for (std::getline(in, line); std::getline(in, line);) {
    std::replace(line.begin(), line.end(), ',', ' ');
    Eigen::Vector3d row;
    if (std::istringstream(line) >> row[0] >> row[1] >> row[2]) rows.push_back(row);
  }
  return rows;
}

// Least-squares polynomial through the last observations, `ahead` s after the newest.
Vector2d Extrapolated(const std::vector<Vector2d>& seen, size_t count, int degree, double ahead) {
  const size_t n = std::min(count, seen.size());
  Eigen::MatrixXd A(n, degree + 1), b(n, 2);
  for (size_t i = 0; i < n; ++i) {
    const double t = -0.05 * static_cast<double>(n - 1 - i);
    for (int k = 0; k <= degree; ++k) A(static_cast<Eigen::Index>(i), k) = std::pow(t, k);
    b.row(static_cast<Eigen::Index>(i)) = seen[seen.size() - n + i];
  }
  const Eigen::MatrixXd fit = A.colPivHouseholderQr().solve(b);
  Vector2d at(0, 0);
  for (int k = degree; k >= 0; --k) at = at * ahead + fit.row(k).transpose();
  return at;
}

}  // namespace

Course GymCourse() {
  const world::Scenario scenario =
      world::LoadScenario(std::string(CHASE_SOURCE_DIR) + "/deploy/scenarios/gym.yaml");
  Course course{"gym", Sampled(world::TargetMotion(scenario)), {}, scenario.target.radius};
  for (const auto& c : scenario.world.cylinders)
    course.obstacles.push_back(Upright(c.center, c.radius, c.radius, 0.0));
  for (const auto& wall : scenario.world.walls) AddWall(wall, &course.obstacles);
  return course;
}

Course TwelveCourse(int number) {
  const std::string folder = std::string(CHASE_SOURCE_DIR) + "/deploy/scenarios/twelve/";
  const std::string name = "S" + std::to_string(number);
  const std::string file = (number < 10 ? "S0" : "S") + std::to_string(number) + "_target.csv";
  Course course{name, Sampled(world::PathMotion(ReadRows(folder + file))), {}};
  for (const auto& pillar : ReadRows(folder + "map" + std::to_string((number + 2) / 3) + ".csv"))
    course.obstacles.push_back(Upright(pillar.head<2>(), pillar.z(), pillar.z(), 0.0));
  return course;
}

Course CorridorCourse() {
  constexpr double kHalf = 1.2;  // of the width, m
  const Vector2d turns[] = {{0, 0},  {6, 0},  {6, 5},  {12, 5},  {12, 0},
                            {18, 0}, {18, 7}, {13, 7}, {13, 12}, {19, 12}};
  const std::vector<Vector2d> waypoints(std::begin(turns), std::end(turns));
  Course course{"corridor", Sampled(world::PathMotion(waypoints, 1.0, 0.5, 1.0)), {}};
  // Walls at half the width to either side of each leg, from corner to corner of the offset lines.
  for (const double side : {kHalf, -kHalf}) {
    const auto corner = [&](size_t i) -> Vector2d {
      Vector2d shift(0, 0);
      const auto normal = [&](size_t leg) {
        const Vector2d d = (waypoints[leg + 1] - waypoints[leg]).normalized();
        return Vector2d(-side * d.y(), side * d.x());
      };
      if (i > 0) shift += normal(i - 1);
      if (i + 1 < waypoints.size()) shift += normal(i);
      return waypoints[i] + shift;
    };
    for (size_t i = 0; i + 1 < waypoints.size(); ++i) {
      world::WallSpec wall;
      wall.from = corner(i);
      wall.to = corner(i + 1);
      wall.thickness = 0.15;
      AddWall(wall, &course.obstacles);
    }
  }
  return course;
}

Course WorldCourse(const std::string& kind, uint64_t seed) {
  const world::Scenario scenario = worlds::MakeWorld(kind, seed, {});
  return {kind, Sampled(world::TargetMotion(scenario)), {}, scenario.target.radius};
}

Course StraightCourse() {
  Course course{"straight", {}, {}};
  for (int i = 0; i < 6000; ++i) course.truth.emplace_back(0.006 * i, 0.008 * i);
  return course;
}

Course DriveCourse(uint64_t seed) {
  InstanceGenerator random(seed);
  const double ds = 0.01, top_speed = 1.0;
  Course course{"drive", {}, {}};
  std::vector<Vector2d> path;
  Vector2d x(0, 0);
  double heading = 0.0;
  const auto advance = [&](double length, double curvature) {
    for (double s = 0; s < length; s += ds, heading += curvature * ds)
      path.push_back(x += ds * Vector2d(std::cos(heading), std::sin(heading)));
  };
  while (path.size() < 7000) {
    advance(random.Uniform(1, 5), 0.0);
    const bool sharp = random.Uniform(0, 1) < 0.67;
    const double radius = sharp ? 0.8 : random.Uniform(1.5, 4);
    const double angle = sharp ? M_PI / 2 : random.Uniform(0.3, 1.5);
    advance(radius * angle, (random.Uniform(0, 1) < 0.5 ? -1 : 1) / radius);
  }
  double s = 0, speed = 0, goal = top_speed, timer = random.Uniform(4, 12);
  for (int i = 0; i < 6000; ++i, timer -= 0.01) {
    if (timer < 0) {
      const bool stop = goal > 0 && random.Uniform(0, 1) < 0.4;
      goal = stop ? 0.0 : random.Uniform(0.5, 1.0) * top_speed;
      timer = stop ? random.Uniform(2, 4) : random.Uniform(4, 12);
    }
    speed += std::clamp(goal - speed, -0.005, 0.005);
    s += 0.01 * speed;
    course.truth.push_back(path[std::min(static_cast<size_t>(s / ds), path.size() - 1)]);
  }
  return course;
}

AccuracyResult MeasureAccuracy(const Course& course, const PredictorConfig& config,
                               const WindowConfig& window_config, double sigma, uint64_t seed) {
  AccuracyResult result;
  InstanceGenerator random(seed);
  ObservationWindow window(window_config);
  const Predictor predictor(config);
  std::vector<Vector2d> seen;
  for (size_t i = 0; i + kFurthest < course.truth.size(); i += kSeen) {
    PredictRequest request;
    request.now = 0.01 * static_cast<double>(i);
    request.target_radius = course.target_radius;
    request.obstacles = course.obstacles;
    const double noise[] = {sigma * random.Normal(), sigma * random.Normal()};
    seen.push_back(course.truth[i] + Vector2d(noise[0], noise[1]));
    window.Add({request.now,
                {seen.back().x(), seen.back().y(), 0.5},
                sigma * sigma * Eigen::Matrix3d::Identity()});
    if (i < 200 || i % kForecast != 0) continue;
    request.observations = window.Merged();
    const PredictResult predicted = predictor.Predict(request);
    const auto forecast_verdict = predicted.verdict;
    const auto& forecast = predicted.trajectory;
    for (int k = 0; k < 3; ++k) {
      const double h = kAhead[k];
      const Vector2d there = course.truth[i + static_cast<size_t>(std::lround(100 * h))];
      const auto squared = [&there](const Vector2d& x) { return (x - there).squaredNorm(); };
      result.ours[k] += squared(forecast.Position(request.now + h).head<2>());
      result.velocity_short[k] += squared(Extrapolated(seen, 11, 1, h));
      result.velocity_long[k] += squared(Extrapolated(seen, 21, 1, h));
      result.acceleration[k] += squared(Extrapolated(seen, 41, 2, h));
    }
    ++result.forecasts;
    result.colliding += forecast_verdict == PredictResult::Verdict::kColliding;
  }
  for (Errors* e :
       {&result.ours, &result.velocity_short, &result.velocity_long, &result.acceleration})
    *e = (*e / std::max(1, result.forecasts)).sqrt();
  return result;
}

AccuracyResult Pooled(const std::vector<AccuracyResult>& results) {
  AccuracyResult sum;
  const auto add = [](const Errors& from, int n, Errors* to) { *to += n * from.square(); };
  for (const AccuracyResult& r : results) {
    add(r.ours, r.forecasts, &sum.ours);
    add(r.velocity_short, r.forecasts, &sum.velocity_short);
    add(r.velocity_long, r.forecasts, &sum.velocity_long);
    add(r.acceleration, r.forecasts, &sum.acceleration);
    sum.forecasts += r.forecasts;
  }
  for (Errors* e : {&sum.ours, &sum.velocity_short, &sum.velocity_long, &sum.acceleration})
    *e = (*e / std::max(1, sum.forecasts)).sqrt();
  return sum;
}

}  // namespace chase::prediction
