#include "services/planning/cost.h"

#include <algorithm>
#include <cmath>

namespace chase::planning {
namespace {

// Newton's iteration on the Legendre polynomial of degree kNodes.
Quadrature MakeQuadrature() {
  Quadrature q{};
  for (int i = 0; i < kNodes; ++i) {
    double z = std::cos(M_PI * (i + 0.75) / (kNodes + 0.5));
    double slope = 1.0;
    for (int iteration = 0; iteration < 60; ++iteration) {
      double p = 1.0, before = 0.0;
      for (int j = 0; j < kNodes; ++j) {
        const double next = ((2 * j + 1) * z * p - j * before) / (j + 1);
        before = p;
        p = next;
      }
      slope = kNodes * (z * p - before) / (z * z - 1.0);
      z -= p / slope;
    }
    q.tau[i] = 0.5 * (1.0 - z);
    q.weight[i] = 1.0 / ((1.0 - z * z) * slope * slope);
  }
  return q;
}

double Falling(Eigen::Index k, int order) {
  double f = 1.0;
  for (int i = 0; i < order; ++i) f *= static_cast<double>(k - i);
  return f;
}

// Integral over [0,T] of the squared derivative of the given order.
double SquaredDerivative(const Curve& plan, int order, double T) {
  double sum = 0.0;
  for (Eigen::Index i = order; i < plan.rows(); ++i)
    for (Eigen::Index j = order; j < plan.rows(); ++j)
      sum += Falling(i, order) * Falling(j, order) * plan.row(i).dot(plan.row(j)) /
             static_cast<double>(i + j - 2 * order + 1);
  return sum * std::pow(T, 1 - 2 * order);
}

/// `target(k, order)`: its derivative at node k; `add_obstacles(k, p, weight, &j2)`: node k's share
/// of J2.
template <class Target, class AddObstacles>
Cost Weigh(const PlannerConfig& config, double T, const Curve& plan, const Target& target,
           const AddObstacles& add_obstacles) {
  Cost cost;
  cost.j1 = config.rho_acceleration * SquaredDerivative(plan, 2, T) +
            config.rho_jerk * SquaredDerivative(plan, 3, T);
  for (int k = 0; k < kNodes; ++k) {
    const double tau = GaussNodes().tau[k], weight = T * GaussNodes().weight[k];
    const Eigen::Vector3d p = Evaluate(plan, tau);
    add_obstacles(k, p, weight, &cost.j2);
    const Eigen::Vector3d r = target(k, 0) - p;
    const Eigen::Vector3d rate = (target(k, 1) - Evaluate(plan, tau, 1)) / T;
    const double excess = r.norm() - config.desired_distance;
    const double rise = config.desired_height() + r.z();
    const double h = std::max(r.head<2>().squaredNorm(), kYawDistanceFloor * kYawDistanceFloor);
    const double yaw_rate = (r.x() * rate.y() - r.y() * rate.x()) / h;
    cost.j3 += weight * (excess * excess + config.rho_height * rise * rise);
    cost.j4 += weight * yaw_rate * yaw_rate;
  }
  cost.total = config.weight_smooth * cost.j1 + config.weight_obstacle * cost.j2 +
               config.weight_distance * cost.j3 + config.weight_yaw * cost.j4;
  return cost;
}

}  // namespace

const Quadrature& GaussNodes() {
  static const Quadrature nodes = MakeQuadrature();
  return nodes;
}

double ObstacleCost(const PlannerConfig& c, double distance) {
  if (distance > c.cost_range) return c.cost_min;
  const double share = (distance - c.cost_range) / c.cost_range;
  return c.cost_min + (c.cost_max - c.cost_min) * share * share;
}

Cost Evaluate(const PlannerConfig& config, const Problem& problem, const Curve& plan) {
  const auto add_obstacles = [&](int k, const Eigen::Vector3d& p, double weight, double* j2) {
    for (const Ellipsoid& e : problem.obstacles) {
      const Eigen::Vector3d d = p - Evaluate(e.center, GaussNodes().tau[k]);
      *j2 += weight * ObstacleCost(config, std::sqrt(d.dot(e.safety * d)));
    }
  };
  const auto target = [&](int k, int order) {
    return Evaluate(problem.target, GaussNodes().tau[k], order);
  };
  return Weigh(config, problem.duration, plan, target, add_obstacles);
}

Objective::Objective(const PlannerConfig& config, const Problem& problem)
    : config_(config), duration_(problem.duration) {
  for (int k = 0; k < kNodes; ++k) {
    const double tau = GaussNodes().tau[k];
    target_[k] = Evaluate(problem.target, tau);
    target_slope_[k] = Evaluate(problem.target, tau, 1);
    for (const Ellipsoid& e : problem.obstacles) centers_.push_back(Evaluate(e.center, tau));
  }
  for (const Ellipsoid& e : problem.obstacles) shapes_.push_back(e.safety);
}

Cost Objective::operator()(const Curve& plan) const {
  const auto add_obstacles = [&](int k, const Eigen::Vector3d& p, double weight, double* j2) {
    const Eigen::Vector3d* centers = centers_.data() + static_cast<size_t>(k) * shapes_.size();
    for (size_t j = 0; j < shapes_.size(); ++j) {
      const Eigen::Vector3d d = p - centers[j];
      *j2 += weight * ObstacleCost(config_, std::sqrt(d.dot(shapes_[j] * d)));
    }
  };
  const auto target = [&](int k, int order) { return order == 0 ? target_[k] : target_slope_[k]; };
  return Weigh(config_, duration_, plan, target, add_obstacles);
}

}  // namespace chase::planning
