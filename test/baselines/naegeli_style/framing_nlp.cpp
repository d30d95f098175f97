#include "test/baselines/naegeli_style/framing_nlp.h"

#include <algorithm>
#include <cmath>

namespace chase::baselines {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

size_t At(int k) { return static_cast<size_t>(k - 1); }

}  // namespace

FramingNlp::FramingNlp(const NaegeliParameters& parameters, const planning::PlannerConfig& config,
                       const planning::PlanRequest& request, const VectorXd& warm)
    : parameters_(parameters),
      config_(config),
      step_(request.horizon / parameters.stages),
      t0_(request.t0),
      start_(request.start),
      bodies_(NearBodies(config, request)) {
  const Stages stages = Roll(warm);
  for (int k = 1; k <= parameters.stages; ++k) {
    const Vector3d q = request.target.Position(request.t0 + k * step_);
    target_.push_back(q);
    constrained_.emplace_back();
    for (size_t j = 0; j < bodies_.size(); ++j) {
      const double radius = bodies_[j].radius + config.drone_radius;
      const double away =
          radius * (std::sqrt(SafetyDistance(bodies_[j], stages.p[At(k)], nullptr)) - 1.0);
      if (away < parameters.pair_reach) constrained_.back().push_back(static_cast<int>(j));
    }
    n_pairs_ += static_cast<int>(constrained_.back().size());
  }
}

FramingNlp::Stages FramingNlp::Roll(const VectorXd& x) const {
  Stages s;
  Vector3d p = start_.p, v = start_.v;
  for (int k = 0; k < parameters_.stages; ++k) {
    const Vector3d a = x.segment<3>(3 * k);
    p += step_ * v + 0.5 * step_ * step_ * a;
    v += step_ * a;
    s.p.push_back(p);
    s.v.push_back(v);
  }
  return s;
}

void FramingNlp::Spread(int k, const Vector3d& slope, double* row) const {
  for (int i = 0; i < k; ++i) {
    const double weight = step_ * step_ * (k - i - 0.5);  // dp_k / da_i
    for (int axis = 0; axis < 3; ++axis) row[3 * i + axis] += weight * slope[axis];
  }
}

double FramingNlp::StageCost(int k, const Vector3d& p, Vector3d* slope) const {
  const NaegeliParameters& w = parameters_;
  const Vector3d r = p - target_[At(k)];
  const double length = std::max(r.norm(), 1e-6), excess = length - w.desired_distance;
  double cost = w.weight_distance * excess * excess;
  *slope = 2.0 * w.weight_distance * excess * r / length;
  const double planar = std::max(r.head<2>().norm(), 1e-3);
  const double angle = std::atan2(r.z(), planar) - w.angle;
  cost += w.weight_angle * angle * angle;
  const double square = planar * planar + r.z() * r.z();
  *slope += 2.0 * w.weight_angle * angle / square *
            Vector3d(-r.z() * r.x() / planar, -r.z() * r.y() / planar, planar);
  for (const Body& body : bodies_) {
    Vector3d d_slope;
    const double lack = 1.0 + w.sight_margin - SightDistance(body, p, target_[At(k)], &d_slope);
    if (lack > 0.0) {
      cost += w.weight_sight * lack * lack;
      *slope -= 2.0 * w.weight_sight * lack * d_slope;
    }
    const double rho = std::sqrt(std::max(SafetyDistance(body, p, &d_slope), 1e-12));
    const double e = std::exp(std::min(60.0, w.steepness * (rho - w.beta)));
    const double potential = 1.0 / (1.0 + e);
    cost += w.weight_potential * potential * potential;
    *slope -= w.weight_potential * 2.0 * potential * potential * potential * e * w.steepness *
              d_slope / (2.0 * rho);
  }
  return cost;
}

double FramingNlp::Effort(const VectorXd& x, VectorXd* gradient) const {
  const double effort = parameters_.weight_effort * step_;
  const double jerk = effort * parameters_.jerk_share;
  double cost = 0.0;
  Vector3d before = start_.a;
  for (int k = 0; k < parameters_.stages; ++k) {
    const Vector3d a = x.segment<3>(3 * k), change = a - before;
    cost += effort * a.squaredNorm() + jerk * change.squaredNorm();
    if (gradient) {
      gradient->segment<3>(3 * k) += 2.0 * effort * a + 2.0 * jerk * change;
      if (k > 0) gradient->segment<3>(3 * (k - 1)) -= 2.0 * jerk * change;
    }
    before = a;
  }
  return cost;
}

double FramingNlp::Cost(const VectorXd& x, VectorXd* gradient) const {
  const double slack = x[3 * parameters_.stages];
  double cost = parameters_.weight_slack * (slack + slack * slack) + Effort(x, gradient);
  if (gradient)
    (*gradient)[3 * parameters_.stages] = parameters_.weight_slack * (1.0 + 2.0 * slack);
  const Stages stages = Roll(x);
  for (int k = 1; k <= parameters_.stages; ++k) {
    Vector3d slope;
    cost += step_ * StageCost(k, stages.p[At(k)], &slope);
    if (gradient) Spread(k, step_ * slope, gradient->data());
  }
  return cost;
}

// Obstacles first, then speed both ways per axis, then height both ways.
void FramingNlp::Constraints(const VectorXd& x, VectorXd* g, Rows* jacobian) const {
  const Stages stages = Roll(x);
  const double slack = x[3 * parameters_.stages];
  int row = 0;
  for (int k = 1; k <= parameters_.stages; ++k)
    for (int j : constrained_[At(k)]) {
      Vector3d slope;
      const double rho = std::sqrt(std::max(
          SafetyDistance(bodies_[static_cast<size_t>(j)], stages.p[At(k)], &slope), 1e-12));
      (*g)[row] = 1.0 - slack - rho;
      if (jacobian) {
        Spread(k, -slope / (2.0 * rho), jacobian->row(row).data());
        (*jacobian)(row, 3 * parameters_.stages) = -1.0;
      }
      ++row;
    }
  for (int k = 1; k <= parameters_.stages; ++k) {
    for (int axis = 0; axis < 3; ++axis)
      for (double sign : {1.0, -1.0}) {
        (*g)[row] = sign * stages.v[At(k)][axis] / config_.max_speed - 1.0;
        if (jacobian)
          for (int i = 0; i < k; ++i)
            (*jacobian)(row, 3 * i + axis) = sign * step_ / config_.max_speed;
        ++row;
      }
    (*g)[row] = config_.z_min - stages.p[At(k)].z();
    if (jacobian) Spread(k, -Vector3d::UnitZ(), jacobian->row(row).data());
    ++row;
    (*g)[row] = stages.p[At(k)].z() - config_.z_max;
    if (jacobian) Spread(k, Vector3d::UnitZ(), jacobian->row(row).data());
    ++row;
  }
}

void FramingNlp::Bounds(VectorXd* low, VectorXd* high) const {
  high->setConstant(config_.max_acceleration);
  *low = -*high;
  (*low)[3 * parameters_.stages] = 0.0;
  (*high)[3 * parameters_.stages] = HUGE_VAL;
}

double FramingNlp::HardViolation(const VectorXd& x) const {
  if (!x.allFinite()) return HUGE_VAL;
  VectorXd g = VectorXd::Zero(n_constraints());
  Constraints(x, &g, nullptr);
  if (!g.allFinite()) return HUGE_VAL;
  return std::max(0.0, g.tail(8 * parameters_.stages).maxCoeff());
}

Pieces FramingNlp::ToPieces(const VectorXd& x) const {
  Pieces pieces;
  Vector3d p = start_.p, v = start_.v;
  for (int k = 0; k < parameters_.stages; ++k) {
    const Vector3d a = x.segment<3>(3 * k);
    world::Trajectory piece{t0_ + k * step_, step_, Eigen::MatrixXd::Zero(3, 3)};
    piece.coefficients.row(0) = p.transpose();
    piece.coefficients.row(1) = step_ * v.transpose();
    piece.coefficients.row(2) = 0.5 * step_ * step_ * a.transpose();
    pieces.push_back(piece);
    p += step_ * v + 0.5 * step_ * step_ * a;
    v += step_ * a;
  }
  return pieces;
}

}  // namespace chase::baselines
