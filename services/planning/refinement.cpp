#include "services/planning/refinement.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "services/planning/certificate.h"

namespace chase::planning {
namespace {

constexpr int kSteps = 4;
constexpr double kReach = 0.5;   // m, that a control point may move in all
constexpr double kLeast = 2e-4;  // relative gain of a step that is worth another
constexpr double kDamping = 1e-6;

double SquaredNorm(const Eigen::Matrix3d& R, const Eigen::Vector3d& d) { return d.dot(R * d); }

}  // namespace

bool Refiner::Set(const Problem& problem, const Curve& plan) {
  problem_ = &problem;
  const int M = static_cast<int>(plan.rows()) - 1;
  if (M < 5 || M > 6 || problem.target.rows() > M + 1) return false;
  free_ = M - 3;
  if (tables_.degree != M || tables_.duration != problem.duration)
    tables_ = CandidateTables(config_, M, 1, problem.duration);
  origin_ = problem.target.row(0).transpose();
  Curve local = plan, target = problem.target;
  local.row(0) -= origin_.transpose();
  target.row(0).setZero();
  first_ = ToPoints(local, M);
  target_ = ToPoints(target, M);
  SetNear();
  return true;
}

void Refiner::SetNear() {
  near_.clear();
  const int n = tables_.degree + 1;
  Eigen::Vector3d p[kNodes];
  for (int k = 0; k < kNodes; ++k) {
    p[k].setZero();
    for (int i = 0; i < n; ++i) p[k] += tables_.phi[k][i] * first_.row(i).transpose();
  }
  for (size_t j = 0; j < problem_->obstacles.size(); ++j) {
    const Ellipsoid& e = problem_->obstacles[j];
    const double range = config_.cost_range + kReach * std::sqrt(e.safety.trace());
    for (int k = 0; k < kNodes; ++k) {
      const Eigen::Vector3d c = Evaluate(e.center, GaussNodes().tau[k]) - origin_;
      if (SquaredNorm(e.safety, p[k] - c) >= range * range) continue;
      near_.push_back({k, static_cast<int>(j), c});
    }
  }
}

Curve Refiner::PlanOf(const Points& b) const {
  Curve plan = ToPower(b, tables_.degree);
  plan.topRows(4) = problem_->start;
  return plan;
}

Cost Refiner::CostOf(const Points& b) const {
  const int n = tables_.degree + 1;
  const double T = problem_->duration;
  Cost cost;
  double smooth = 0.0, near = 0.0;
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) smooth += tables_.smooth(i, j) * b.row(i).dot(b.row(j));
  Eigen::Vector3d at[kNodes];
  for (int k = 0; k < kNodes; ++k) {
    Eigen::Vector3d p = Eigen::Vector3d::Zero(), q = p, v = p;
    for (int i = 0; i < n; ++i) {
      p += tables_.phi[k][i] * b.row(i).transpose();
      q += tables_.phi[k][i] * target_.row(i).transpose();
      v += tables_.slope[k][i] * (b.row(i) - target_.row(i)).transpose();
    }
    at[k] = p;
    const Eigen::Vector3d r = p - q;
    const double weight = T * GaussNodes().weight[k], e = r.norm() - config_.desired_distance;
    const double h = std::max(r.head<2>().squaredNorm(), kYawDistanceFloor * kYawDistanceFloor);
    const double rate = (r.x() * v.y() - r.y() * v.x()) / h;
    cost.j3 += weight * e * e;
    cost.j4 += weight * rate * rate;
  }
  for (const Near& o : near_) {
    const Eigen::Matrix3d& R = problem_->obstacles[static_cast<size_t>(o.obstacle)].safety;
    const double l = std::sqrt(SquaredNorm(R, at[o.node] - o.center)) - config_.cost_range;
    if (l < 0.0) near += T * GaussNodes().weight[o.node] * l * l;
  }
  const double range2 = config_.cost_range * config_.cost_range;
  cost.j1 = config_.weight_smooth > 0.0 ? smooth / config_.weight_smooth : 0.0;
  cost.j2 = (config_.cost_max - config_.cost_min) / range2 * near +
            config_.cost_min * T * static_cast<double>(problem_->obstacles.size());
  cost.total = smooth + config_.weight_obstacle * cost.j2 + config_.weight_distance * cost.j3 +
               config_.weight_yaw * cost.j4;
  return cost;
}

// A term of the position at a node: p = sum of phi_f x_f.
void Refiner::AddPull(int node, const Eigen::Vector3d& gradient, const Eigen::Matrix3d& hessian,
                      Vector* g, Matrix* H) const {
  for (int f = 0; f < free_; ++f) {
    const double a = tables_.phi[node][4 + f];
    g->segment<3>(3 * f) += a * gradient;
    for (int e = 0; e <= f; ++e)
      H->block<3, 3>(3 * f, 3 * e) += a * tables_.phi[node][4 + e] * hessian;
  }
}

// J3 and J4 at a node; second derivatives of the residuals only where they add to the curvature.
void Refiner::AddNode(int node, const Points& b, Vector* gradient, Matrix* hessian) const {
  const int n = tables_.degree + 1;
  Eigen::Vector3d r = Eigen::Vector3d::Zero(), v = r;
  for (int i = 0; i < n; ++i) {
    r += tables_.phi[node][i] * (b.row(i) - target_.row(i)).transpose();
    v += tables_.slope[node][i] * (b.row(i) - target_.row(i)).transpose();
  }
  const double weight = 2.0 * problem_->duration * GaussNodes().weight[node];
  const double distance = std::max(1e-6, r.norm()), e = distance - config_.desired_distance;
  const Eigen::Vector3d u = r / distance;
  const double w3 = weight * config_.weight_distance, bend = std::max(0.0, e / distance);
  const Eigen::Matrix3d along = u * u.transpose();
  AddPull(node, w3 * e * u, w3 * (along + bend * (Eigen::Matrix3d::Identity() - along)), gradient,
          hessian);
  const double floor2 = kYawDistanceFloor * kYawDistanceFloor, h2 = r.head<2>().squaredNorm();
  const double h = std::max(h2, floor2), y = (r.x() * v.y() - r.y() * v.x()) / h;
  const double by_h = h2 > floor2 ? -2.0 * y / h : 0.0;
  const Eigen::Vector3d by_r(v.y() / h + by_h * r.x(), -v.x() / h + by_h * r.y(), 0.0);
  const Eigen::Vector3d by_v(-r.y() / h, r.x() / h, 0.0);
  Vector slope(3 * free_);
  for (int f = 0; f < free_; ++f)
    slope.segment<3>(3 * f) = tables_.phi[node][4 + f] * by_r + tables_.slope[node][4 + f] * by_v;
  const double w4 = weight * config_.weight_yaw;
  *gradient += w4 * y * slope;
  hessian->triangularView<Eigen::Lower>() += w4 * slope * slope.transpose();
}

void Refiner::Model(const Points& b, Vector* gradient, Matrix* hessian) const {
  const int n = tables_.degree + 1;
  gradient->setZero(3 * free_);
  hessian->setZero(3 * free_, 3 * free_);
  for (int f = 0; f < free_; ++f) {
    Eigen::RowVector3d pull = Eigen::RowVector3d::Zero();
    for (int i = 0; i < n; ++i) pull += 2.0 * tables_.smooth(4 + f, i) * b.row(i);
    gradient->segment<3>(3 * f) += pull.transpose();
    for (int e = 0; e <= f; ++e)
      hessian->block<3, 3>(3 * f, 3 * e).diagonal().array() += 2.0 * tables_.smooth(4 + f, 4 + e);
  }
  for (int k = 0; k < kNodes; ++k) AddNode(k, b, gradient, hessian);
  const double scale = 2.0 * config_.weight_obstacle * (config_.cost_max - config_.cost_min) /
                       (config_.cost_range * config_.cost_range);
  for (const Near& o : near_) {
    Eigen::Vector3d d = -o.center;
    for (int i = 0; i < n; ++i) d += tables_.phi[o.node][i] * b.row(i).transpose();
    const Eigen::Vector3d Rd = problem_->obstacles[static_cast<size_t>(o.obstacle)].safety * d;
    const double s = std::sqrt(std::max(1e-12, d.dot(Rd))), l = s - config_.cost_range;
    if (l >= 0.0) continue;
    const double weight = scale * problem_->duration * GaussNodes().weight[o.node];
    AddPull(o.node, weight * l / s * Rd, weight / (s * s) * Rd * Rd.transpose(), gradient, hessian);
  }
}

bool Refiner::Step(const Vector& direction, Points* b, Curve* plan, Cost* cost) {
  for (const double share : {1.0, 0.5, 0.25, 0.1}) {
    Points moved = *b;
    for (int f = 0; f < free_; ++f) {
      const Eigen::RowVector3d at = b->row(4 + f) + share * direction.segment<3>(3 * f).transpose();
      const Eigen::RowVector3d offset = at - first_.row(4 + f);
      moved.row(4 + f) =
          first_.row(4 + f) + offset * std::min(1.0, kReach / std::max(1e-9, offset.norm()));
    }
    const Cost next = CostOf(moved);
    if (!(next.total < cost->total)) continue;
    const Curve curve = PlanOf(moved);
    if (!proof_.Holds(curve) || !KeepsLimits(curve, *problem_)) continue;
    *b = moved;
    *plan = curve;
    *cost = next;
    return true;
  }
  return false;
}

bool Refiner::Improve(const Problem& problem, double sight_from, Curve* plan, Cost* cost) {
  if (!Set(problem, *plan)) return false;
  proof_.Reset(problem, sight_from, config_.exact_visibility);
  Points b = first_;
  bool changed = false;
  for (int step = 0; step < kSteps; ++step) {
    Vector gradient;
    Matrix hessian;
    Model(b, &gradient, &hessian);
    hessian.diagonal().array() += kDamping + 1e-3 * hessian.diagonal().array().abs();
    const Eigen::LLT<Matrix> llt(hessian);
    if (llt.info() != Eigen::Success) break;
    const double before = cost->total;
    if (!Step(-llt.solve(gradient), &b, plan, cost)) break;
    changed = true;
    if (before - cost->total < kLeast * before) break;
  }
  return changed;
}

}  // namespace chase::planning
