#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <random>
#include <vector>

#include "services/planning/planner.h"
#include "services/planning/problem.h"
#include "services/planning/reference_search.h"
#include "services/planning/skeletons.h"

namespace chase::planning {

/// Seeded chasing problems: a curved target path, a drone near its desired distance, obstacles of
/// full 3x3 shape, every other one moving. Those are accepted one by one while at least a share
/// `feasible_low` to `feasible_high` (drawn) of sampled candidates stays clear of them.
struct InstanceSpec {
  double horizon = 5.0;
  int n_obstacles = 50;
  double feasible_low = 0.3, feasible_high = 0.8;
  double extent = 5.5;  // m, around the target's path
};

class InstanceGenerator {
 public:
  InstanceGenerator(const PlannerConfig& config, const InstanceSpec& spec)
      : config_(config), spec_(spec) {}

  PlanRequest Make(unsigned seed) const {
    std::mt19937 g(seed);
    PlanRequest request = TargetAndStart(g);
    const std::vector<Path> paths = SamplePaths(request, g);
    std::vector<char> alive(paths.size(), 1);
    const double share = Uniform(g, spec_.feasible_low, spec_.feasible_high);
    for (int tries = 1; static_cast<int>(request.obstacles.size()) < spec_.n_obstacles; ++tries) {
      const world::Obstacle o = RandomObstacle(request, g, 1.0 + tries / 400.0);
      if (HoldsTarget(o, request) || BlocksStart(o, request)) continue;
      const Centers centers = CentersOf(o, request);
      std::vector<char> left = alive;
      int count = 0;
      for (size_t i = 0; i < paths.size(); ++i) {
        left[i] = static_cast<char>(left[i] && !Blocks(o, centers, paths[i]));
        count += left[i];
      }
      if (count < share * static_cast<double>(paths.size())) continue;
      alive = left;
      request.obstacles.push_back(o);
    }
    return request;
  }

 private:
  static double Uniform(std::mt19937& g, double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(g);
  }
  static Eigen::Vector3d Uniform3(std::mt19937& g, double x, double y, double z) {
    const double a = Uniform(g, -x, x), b = Uniform(g, -y, y), c = Uniform(g, -z, z);
    return {a, b, c};
  }

  PlanRequest TargetAndStart(std::mt19937& g) const {
    const double T = spec_.horizon, heading = Uniform(g, -M_PI, M_PI), speed = Uniform(g, 0.6, 2.0);
    const Eigen::Vector3d along(std::cos(heading), std::sin(heading), 0.0);
    const Eigen::Vector3d across(-along.y(), along.x(), 0.0);
    PlanRequest request;
    request.t0 = 0.0;
    request.horizon = T;
    request.target = {0.0, T, Eigen::MatrixXd::Zero(6, 3)};
    const Eigen::Vector3d q0 = Uniform3(g, 20.0, 20.0, 0.0) + Eigen::Vector3d::UnitZ();
    const double bend = Uniform(g, -0.25, 0.25) * speed * T / 5.0;
    Eigen::Matrix<double, 6, 3> control;
    for (int i = 0; i < 6; ++i) {
      const double wobble = i > 1 ? Uniform(g, -0.25, 0.25) : 0.0;
      control.row(i) = (q0 + along * speed * T * i / 5.0 + across * (bend * i * i / 5.0 + wobble) +
                        Uniform3(g, 0.0, 0.0, 0.1))
                           .transpose();
    }
    for (int k = 0; k < 6; ++k)
      for (int i = 0; i <= k; ++i)
        request.target.coefficients.row(k) +=
            ((k - i) % 2 ? -1.0 : 1.0) * Choose(5, k) * Choose(k, i) * control.row(i);
    const double azimuth = Uniform(g, -M_PI / 2, M_PI / 2);
    const Eigen::Vector3d behind = along * std::cos(azimuth) + across * std::sin(azimuth);
    request.start.p = request.target.Position(0.0) -
                      behind * config_.desired_distance * Uniform(g, 0.9, 1.1) +
                      Eigen::Vector3d(0.0, 0.0, 0.8);
    request.start.v =
        request.target.Velocity(0.0) * Uniform(g, 0.7, 1.1) + Uniform3(g, 0.3, 0.3, 0.1);
    request.start.a = Uniform3(g, 0.3, 0.3, 0.1);
    request.start.j = Uniform3(g, 0.1, 0.1, 0.05);
    return request;
  }

  using Path = Eigen::Matrix<double, 3, 25>;
  std::vector<Path> SamplePaths(const PlanRequest& request, std::mt19937& g) const {
    Problem problem = MakeProblem(config_, request, nullptr);
    SkeletonPlacer(config_).PlaceRing(config_.steps, config_.skeletons, &problem);
    const KktCandidates candidates(config_, problem);
    std::vector<Path> paths;
    for (int i = 0; i < 96; ++i) {
      const int index = static_cast<int>(g() % static_cast<unsigned>(problem.n_candidates()));
      const Curve candidate = candidates(index);
      paths.emplace_back();
      for (int k = 0; k <= 24; ++k) paths.back().col(k) = Evaluate(candidate, k / 24.0);
    }
    return paths;
  }

  world::Obstacle RandomObstacle(const PlanRequest& request, std::mt19937& g, double grow) const {
    world::Obstacle o;
    o.id = static_cast<int>(request.obstacles.size());
    o.moving = o.id % 2 == 1;
    const double extent =
        (0.5 * request.target.Velocity(0.0).norm() * spec_.horizon + spec_.extent) * grow;
    Eigen::Vector3d c = request.target.Position(0.5 * spec_.horizon) +
                        Uniform3(g, extent, extent, 1.0) + Eigen::Vector3d(0.0, 0.0, 0.5);
    const Eigen::Vector3d v = o.moving ? Uniform3(g, 0.8, 0.8, 0.1) : Eigen::Vector3d::Zero();
    o.center = {0.0, spec_.horizon, Eigen::MatrixXd::Zero(o.moving ? 2 : 1, 3)};
    o.center.coefficients.row(0) = (c - 0.5 * spec_.horizon * v).transpose();
    if (o.moving) o.center.coefficients.row(1) = spec_.horizon * v.transpose();
    Eigen::Matrix3d A;
    for (int i = 0; i < 9; ++i) A.data()[i] = Uniform(g, -1.0, 1.0);
    const Eigen::Matrix3d Q = Eigen::HouseholderQR<Eigen::Matrix3d>(A).householderQ();
    const double a = Uniform(g, 0.25, 0.9), b = Uniform(g, 0.25, 0.9), h = Uniform(g, 0.4, 1.6);
    const Eigen::Vector3d inverse(1 / (a * a), 1 / (b * b), 1 / (h * h));
    o.shape = Q * inverse.asDiagonal() * Q.transpose();
    o.shape = 0.5 * (o.shape + o.shape.transpose()).eval();
    return o;
  }

  bool HoldsTarget(const world::Obstacle& o, const PlanRequest& request) const {
    for (int i = 0; i <= 100; ++i) {
      const double t = spec_.horizon * i / 100.0;
      if (o.SquaredDistance(request.target.Position(t), t) < 1.1) return true;
    }
    return false;
  }
  static bool BlocksStart(const world::Obstacle& o, const PlanRequest& request) {
    const Eigen::Vector3d p = request.start.p - o.center.Position(0.0);
    const Eigen::Vector3d q = request.target.Position(0.0) - o.center.Position(0.0);
    return p.dot(o.shape * p) < 1.1 || p.dot(o.shape * q) < 1.05;
  }
  /// Squared radii of a path's samples, and with the target's: the paper's d_p and d_s.
  struct Centers {
    Eigen::Matrix<double, 3, 25> c, y;  ///< centre; R (q - c)
  };
  Centers CentersOf(const world::Obstacle& o, const PlanRequest& request) const {
    Centers centers;
    for (int i = 0; i <= 24; ++i) {
      const double t = spec_.horizon * i / 24.0;
      centers.c.col(i) = o.center.Position(t);
      centers.y.col(i) = o.shape * (request.target.Position(t) - centers.c.col(i));
    }
    return centers;
  }
  static bool Blocks(const world::Obstacle& o, const Centers& centers,
                     const Eigen::Matrix<double, 3, 25>& path) {
    for (int i = 0; i <= 24; ++i) {
      const Eigen::Vector3d x = path.col(i) - centers.c.col(i);
      if (x.dot(o.shape * x) < 1.0 || x.dot(centers.y.col(i)) < 1.0) return true;
    }
    return false;
  }
  static double Choose(int n, int k) {
    double value = 1.0;
    for (int i = 0; i < k; ++i) value = value * (n - i) / (i + 1);
    return value;
  }

  PlannerConfig config_;
  InstanceSpec spec_;
};

}  // namespace chase::planning
