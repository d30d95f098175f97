#include "services/planning/problem.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "services/planning/candidate_set.h"

namespace chase::planning {
namespace {

// Margins are taken back in these shares until the start, or the target, is outside the shape.
constexpr double kShares[] = {1.0, 0.75, 0.5, 0.25, 0.0};
constexpr double kClear = 1.02;
constexpr double kLeaveBy = 0.25;  // tau by which a plan has left an obstacle that it starts in

double SquaredNorm(const Eigen::Matrix3d& R, const Eigen::Vector3d& x) { return x.dot(R * x); }

// The obstacle's own shape, and grown.
class Shape {
 public:
  explicit Shape(const Eigen::Matrix3d& R) : R_(R) {}
  Eigen::Matrix3d Grown(double margin) {
    if (!(margin > 0.0)) return R_;
    if (!inflation_) inflation_.emplace(R_);
    return inflation_->By(margin);
  }

 private:
  const Eigen::Matrix3d& R_;
  std::optional<world::Inflation> inflation_;  // axes are not worked out for nothing
};

// Encloses the ellipsoid and all balls of radius `room` about its points: the inverse of the shape
// is (1 + s) (R^-1 + room^2 / s) for any s > 0; this s is tight across the axis of upright shapes.
Eigen::Matrix3d Enlarged(const Eigen::Matrix3d& R, double room) {
  const double s = room * std::sqrt(0.5 * R.trace());
  Eigen::Matrix3d inverse = R.inverse();
  inverse.diagonal().array() += room * room / s;
  return ((1.0 + s) * inverse).inverse();
}

double Uncertainty(const PlannerConfig& config, const world::Obstacle& o, double duration) {
  const double half = 0.5 * duration;
  const double sigma = std::sqrt(o.position_variance + o.velocity_variance * half * half);
  return std::min(config.max_inflation, config.sigmas * sigma);
}

constexpr int kSamples = 24;

// A curve and a box around it, where its degree allows one.
struct Hull {
  const Curve& curve;
  std::optional<Box> box;

  explicit Hull(const Curve& curve_) : curve(curve_) {
    if (curve.rows() <= 7) box = BoxOf(ToPoints(curve, 6), 7, 1e-6);
  }
};

// A quick sufficient test that the curve stays well out.
bool IsPlainlyOutside(const Hull& curve, const Curve& center, const Eigen::Matrix3d& R) {
  return curve.box && !MayTouch(*curve.box, center, R, kClear);
}

bool StaysOutside(const Curve& curve, const Curve& center, const Eigen::Matrix3d& R, double limit) {
  for (int i = 0; i <= kSamples; ++i) {
    const double tau = static_cast<double>(i) / kSamples;
    if (SquaredNorm(R, Evaluate(curve, tau) - Evaluate(center, tau)) <= limit) return false;
  }
  return true;
}

void Note(std::string* notes, const std::string& text) {
  if (!notes) return;
  if (!notes->empty()) *notes += "; ";
  *notes += text;
}

void SetSafetyShape(const PlannerConfig& config, const world::Obstacle& o, const Problem& problem,
                    Shape* shape, Ellipsoid* e, std::string* notes) {
  const double margin =
      config.drone_radius + config.safety_margin + Uncertainty(config, o, problem.duration);
  const Eigen::Vector3d offset = (problem.start.row(0) - e->center.row(0)).transpose();
  for (double share : kShares) {
    e->safety = shape->Grown(share * margin);
    if (SquaredNorm(e->safety, offset) > (share > 0.0 ? kClear : 1.0)) {
      if (share < 1.0) Note(notes, "starts within the margin of obstacle " + std::to_string(e->id));
      return;
    }
  }
  e->safety_from = kLeaveBy;
  Note(notes, "starts inside obstacle " + std::to_string(e->id));
}

void SetSightShape(const PlannerConfig& config, double target_growth, const Hull& target,
                   Shape* shape, Ellipsoid* e, std::string* notes) {
  const double margin = config.sight_margin + target_growth;
  for (double share : kShares) {
    e->sight = shape->Grown(share * margin);
    if (IsPlainlyOutside(target, e->center, e->sight)) return;
    if (margin == 0.0 || StaysOutside(target.curve, e->center, e->sight, kClear)) break;
  }
  if (StaysOutside(target.curve, e->center, e->sight, 1.0)) return;
  e->sight_from = 1.0;
  Note(notes, "obstacle " + std::to_string(e->id) + " holds the target, its shadow is ignored");
}

void SetEllipsoid(const PlannerConfig& config, const PlanRequest& request, const Hull& target,
                  const world::Obstacle& o, const Problem& problem, Ellipsoid* e,
                  std::string* notes) {
  e->id = o.id;
  e->safety_from = e->sight_from = 0.0;
  e->center = ToCurve(o.center, request.t0, request.horizon);
  Shape shape(o.shape);
  SetSafetyShape(config, o, problem, &shape, e, notes);
  const double growth = std::min(config.max_inflation, config.sigmas * request.target_sigma);
  SetSightShape(config, growth, target, &shape, e, notes);
}

// Limits that the start already breaks give way to just above what it has: the plan may not get
// worse than that.
Limits MakeLimits(const PlannerConfig& c, const world::State& s, const Eigen::Vector3d& target) {
  Limits limits;
  limits.speed = c.max_speed > 0.0 ? std::max(c.max_speed, 1.1 * s.v.norm() + 0.05) : 0.0;
  limits.acceleration =
      c.max_acceleration > 0.0 ? std::max(c.max_acceleration, 1.2 * s.a.norm() + 0.1) : 0.0;
  limits.height = c.z_max > c.z_min;
  const double sink = std::max(0.0, -s.v.z()) * 0.5 + 0.1,
               rise = std::max(0.0, s.v.z()) * 0.5 + 0.1;
  limits.z_min = std::min(c.z_min, s.p.z() - sink);
  limits.z_max = std::max(c.z_max, s.p.z() + rise);
  const Eigen::Vector3d r = target - s.p;
  const double tangent = std::tan(c.max_elevation_deg * M_PI / 180.0);
  const bool in_field = std::abs(r.z()) < 0.95 * tangent * r.head<2>().norm();
  limits.tan_elevation = in_field ? tangent : 0.0;
  limits.min_distance = std::min(c.min_distance, 0.9 * r.norm());
  return limits;
}

Curve StartCurve(const world::State& s, double T) {
  Curve c(4, 3);
  c.row(0) = s.p.transpose();
  c.row(1) = T * s.v.transpose();
  c.row(2) = T * T / 2.0 * s.a.transpose();
  c.row(3) = T * T * T / 6.0 * s.j.transpose();
  return c;
}

}  // namespace

int Problem::n_candidates() const {
  int n = 1;
  for (const auto& choices : skeletons) n *= static_cast<int>(choices.size());
  return n;
}

void MakeProblem(const PlannerConfig& config, const PlanRequest& request, std::string* notes,
                 Problem* problem) {
  problem->duration = request.horizon;
  problem->degree = config.degree;
  problem->start = StartCurve(request.start, request.horizon);
  problem->target = ToCurve(request.target, request.t0, request.horizon);
  problem->limits = MakeLimits(config, request.start, problem->target.row(0).transpose());
  problem->skeletons.clear();
  problem->reach.reset();
  problem->obstacles.resize(request.obstacles.size());
  const Hull target(problem->target);
  for (size_t j = 0; j < request.obstacles.size(); ++j)
    SetEllipsoid(config, request, target, request.obstacles[j], *problem, &problem->obstacles[j],
                 notes);
}

Problem MakeProblem(const PlannerConfig& config, const PlanRequest& request, std::string* notes) {
  Problem problem;
  MakeProblem(config, request, notes, &problem);
  return problem;
}

Problem WithRoom(const Problem& problem, double room) {
  Problem roomy;
  roomy.duration = problem.duration;
  roomy.degree = problem.degree;
  roomy.start = problem.start;
  roomy.target = problem.target;
  roomy.limits = problem.limits;
  roomy.reach = problem.reach;
  const size_t n = problem.reach ? problem.near.size() : problem.obstacles.size();
  roomy.obstacles.reserve(n);
  const Hull target(problem.target);
  for (size_t i = 0; i < n; ++i) {
    const size_t j = problem.reach ? static_cast<size_t>(problem.near[i]) : i;
    roomy.near.push_back(static_cast<int>(i));
    roomy.obstacles.push_back(problem.obstacles[j]);
    Ellipsoid& e = roomy.obstacles.back();
    if (!(room > 0.0)) continue;
    const Eigen::Matrix3d safety = Enlarged(e.safety, room), sight = Enlarged(e.sight, room);
    const Eigen::Vector3d offset = (problem.start.row(0) - e.center.row(0)).transpose();
    if (SquaredNorm(safety, offset) > kClear) e.safety = safety;
    if (IsPlainlyOutside(target, e.center, sight) ||
        StaysOutside(problem.target, e.center, sight, kClear))
      e.sight = sight;
  }
  return roomy;
}

Curve ToCurve(const world::Trajectory& trajectory, double start, double duration) {
  Curve c = trajectory.coefficients;
  const double a = (start - trajectory.start) / trajectory.duration;
  const double b = duration / trajectory.duration;
  if (c.rows() == 1 || (a == 0.0 && b == 1.0)) return c;
  c.setZero();
  const Eigen::Index n = c.rows() - 1;
  for (Eigen::Index k = n; k >= 0; --k) {
    for (Eigen::Index i = n; i > 0; --i) c.row(i) = a * c.row(i) + b * c.row(i - 1);
    c.row(0) = a * c.row(0) + trajectory.coefficients.row(k);
  }
  return c;
}

Eigen::Vector3d Evaluate(const Curve& curve, double tau, int order) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Eigen::Index k = curve.rows() - 1; k >= order; --k) {
    double falling = 1.0;
    for (int i = 0; i < order; ++i) falling *= static_cast<double>(k - i);
    sum = sum * tau + falling * curve.row(k).transpose();
  }
  return sum;
}

}  // namespace chase::planning
