#include "test/baselines/penin_style/tracking_nlp.h"

#include <algorithm>
#include <cmath>

namespace chase::baselines {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kGravity = 9.81;  // m/s^2

Eigen::Map<const Eigen::Matrix<double, Spline::kFree, 3, Eigen::RowMajor>> Free(const VectorXd& x) {
  return Eigen::Map<const Eigen::Matrix<double, Spline::kFree, 3, Eigen::RowMajor>>(x.data());
}

/// Thrust direction n, and d(w'n)/da for any w.
struct Thrust {
  explicit Thrust(const Vector3d& a) : f(a + kGravity * Vector3d::UnitZ()), norm(f.norm()) {
    n = f / norm;
  }
  Vector3d Slope(const Vector3d& w) const { return (w - w.dot(n) * n) / norm; }
  Vector3d f;
  double norm;
  Vector3d n;
};

}  // namespace

double ImageElevation(const Vector3d& u, const Vector3d& a, Vector3d* dp, Vector3d* da) {
  const Thrust thrust(a);
  const double length = u.norm(), c = u.dot(thrust.n) / length;
  *dp = -(thrust.n - c * u / length) / length;
  *da = thrust.Slope(u / length);
  return c;
}

double AxisCosine(const Vector3d& u, const Vector3d& a, Vector3d* dp, Vector3d* da) {
  const Thrust thrust(a);
  const Vector3d flat(u.x(), u.y(), 0.0);
  const double length = u.norm(), rho = std::max(flat.norm(), 1e-6);
  const Vector3d heading = flat / rho;
  const double s = heading.dot(thrust.n), c = u.dot(thrust.n) / length, k = rho / length;
  const double w2 = std::max(1.0 - s * s, 1e-6), w = std::sqrt(w2);
  const double top = k - s * c;
  // Slopes with respect to u; with respect to p they change sign.
  const Vector3d planar(thrust.n.x(), thrust.n.y(), 0.0);
  const Vector3d dk = heading / length - k * u / (length * length);
  const Vector3d dc = (thrust.n - c * u / length) / length;
  const Vector3d ds = (planar - s * heading) / rho;
  const auto total = [&](const Vector3d& k_, const Vector3d& s_, const Vector3d& c_) -> Vector3d {
    return (k_ - s * c_ - c * s_) / w + top * s * s_ / (w2 * w);
  };
  *dp = -total(dk, ds, dc);
  *da = total(Vector3d::Zero(), thrust.Slope(heading), thrust.Slope(u / length));
  return top / w;
}

double BearingRate(const Vector3d& u, const Vector3d& w, Vector3d* dp, Vector3d* dv) {
  constexpr double kFloor = 0.25;  // m^2
  const double square = u.head<2>().squaredNorm(), below = std::max(square, kFloor);
  const double rate = (u.x() * w.y() - u.y() * w.x()) / below;
  *dp = -Vector3d(w.y(), -w.x(), 0.0) / below;
  if (square > kFloor) *dp += rate * 2.0 / below * Vector3d(u.x(), u.y(), 0.0);
  *dv = -Vector3d(-u.y(), u.x(), 0.0) / below;
  return rate;
}

TrackingNlp::TrackingNlp(const PeninParameters& parameters, const planning::PlannerConfig& config,
                         const planning::PlanRequest& request, const Spline& spline,
                         const VectorXd& warm)
    : parameters_(parameters),
      max_speed_(config.max_speed),
      z_min_(config.z_min),
      z_max_(config.z_max),
      fixed_(spline.Fixed(request.start)),
      smooth_(parameters.weight_smooth * (spline.Gram(3) + spline.Gram(2))),
      bodies_(NearBodies(config, request)) {
  const Spline::Controls controls = ToControls(warm);
  const double step = spline.duration() / parameters.samples;
  for (int i = 1; i <= parameters.samples; ++i) {
    Instant instant;
    const double t = i * step;
    instant.weight = i < parameters.samples ? step : 0.5 * step;
    instant.target = request.target.Position(request.t0 + t);
    instant.target_velocity = request.target.Velocity(request.t0 + t);
    for (int order = 0; order < 3; ++order) instant.basis[order] = spline.Basis(t, order);
    const Flat flat = At(instant, controls);
    for (size_t j = 0; j < bodies_.size(); ++j) {
      // d counts in squared radii: metres from the surface of the section.
      const double radius = bodies_[j].radius + config.drone_radius;
      const double away =
          radius * (std::sqrt(SightDistance(bodies_[j], flat.p, instant.target, nullptr)) - 1.0);
      if (away < parameters.pair_reach) instant.bodies.push_back(static_cast<int>(j));
    }
    instants_.push_back(instant);
  }
}

int TrackingNlp::n_constraints() const {
  int n = 0;
  for (const Instant& i : instants_) n += kPlain + 2 * static_cast<int>(i.bodies.size());
  return n;
}

Spline::Controls TrackingNlp::ToControls(const VectorXd& x) const {
  Spline::Controls controls;
  controls.topRows<Spline::kFixed>() = fixed_;
  controls.bottomRows<Spline::kFree>() = Free(x);
  return controls;
}

TrackingNlp::Flat TrackingNlp::At(const Instant& instant, const Spline::Controls& controls) const {
  return {(instant.basis[0] * controls).transpose(), (instant.basis[1] * controls).transpose(),
          (instant.basis[2] * controls).transpose()};
}

// Chain rule from p, v, a to the free control points.
void TrackingNlp::Spread(const Instant& instant, const Slope& slope, double factor, double* row) {
  for (int i = 0; i < Spline::kFree; ++i) {
    const int c = i + Spline::kFixed;
    const Vector3d d = factor * (instant.basis[0][c] * slope.p + instant.basis[1][c] * slope.v +
                                 instant.basis[2][c] * slope.a);
    for (int axis = 0; axis < 3; ++axis) row[3 * i + axis] += d[axis];
  }
}

double TrackingNlp::InstantCost(const Instant& instant, const Flat& flat, Slope* slope) const {
  const Vector3d u = instant.target - flat.p, w = instant.target_velocity - flat.v;
  const double length = std::max(u.norm(), 1e-6), excess = length - parameters_.desired_distance;
  Vector3d dp, da, dv;
  const double elevation = ImageElevation(u, flat.a, &dp, &da);
  slope->p = -2.0 * parameters_.weight_distance * excess * u / length +
             2.0 * parameters_.weight_image * elevation * dp;
  slope->a = 2.0 * parameters_.weight_image * elevation * da;
  const double rate = BearingRate(u, w, &dp, &dv);
  slope->p += 2.0 * parameters_.weight_yaw * rate * dp;
  slope->v = 2.0 * parameters_.weight_yaw * rate * dv;
  return parameters_.weight_distance * excess * excess +
         parameters_.weight_image * elevation * elevation + parameters_.weight_yaw * rate * rate;
}

double TrackingNlp::Cost(const VectorXd& x, VectorXd* gradient) const {
  const Spline::Controls controls = ToControls(x);
  const Spline::Controls slope = smooth_ * controls;
  double cost = controls.cwiseProduct(slope).sum();
  if (gradient)
    for (int i = 0; i < Spline::kFree; ++i)
      gradient->segment<3>(3 * i) = 2.0 * slope.row(i + Spline::kFixed).transpose();
  for (const Instant& instant : instants_) {
    Slope s;
    cost += instant.weight * InstantCost(instant, At(instant, controls), &s);
    if (gradient) Spread(instant, s, instant.weight, gradient->data());
  }
  return cost;
}

// Field of view, thrust, speed, height and distance, all without dimension.
void TrackingNlp::Plain(const Instant& instant, const Flat& flat, double* g, Slope* slopes) const {
  const PeninParameters& p = parameters_;
  const Vector3d u = instant.target - flat.p;
  g[0] = std::cos(p.field_deg * M_PI / 180.0) - AxisCosine(u, flat.a, &slopes[0].p, &slopes[0].a);
  slopes[0].p *= -1.0;
  slopes[0].a *= -1.0;
  const Vector3d f = flat.a / kGravity + Vector3d::UnitZ();
  g[1] = p.least_thrust * p.least_thrust - f.squaredNorm();
  slopes[1].a = -2.0 / kGravity * f;
  g[2] = f.squaredNorm() - p.greatest_thrust * p.greatest_thrust;
  slopes[2].a = 2.0 / kGravity * f;
  g[3] = flat.v.squaredNorm() / (max_speed_ * max_speed_) - 1.0;
  slopes[3].v = 2.0 / (max_speed_ * max_speed_) * flat.v;
  g[4] = z_min_ - flat.p.z();
  slopes[4].p = -Vector3d::UnitZ();
  g[5] = flat.p.z() - z_max_;
  slopes[5].p = Vector3d::UnitZ();
  const double near2 = p.least_distance * p.least_distance,
               far2 = p.greatest_distance * p.greatest_distance;
  g[6] = 1.0 - u.squaredNorm() / near2;
  slopes[6].p = 2.0 / near2 * u;
  g[7] = u.squaredNorm() / far2 - 1.0;
  slopes[7].p = -2.0 / far2 * u;
}

void TrackingNlp::Constraints(const VectorXd& x, VectorXd* g, Rows* jacobian) const {
  const Spline::Controls controls = ToControls(x);
  int row = 0;
  const auto put = [&](const Instant& instant, double value, const Slope& slope) {
    (*g)[row] = value;
    if (jacobian) Spread(instant, slope, 1.0, jacobian->row(row).data());
    ++row;
  };
  for (const Instant& instant : instants_) {
    const Flat flat = At(instant, controls);
    double plain[kPlain];
    Slope slopes[kPlain];
    Plain(instant, flat, plain, slopes);
    for (int k = 0; k < kPlain; ++k) put(instant, plain[k], slopes[k]);
    for (int j : instant.bodies) {
      const Body& body = bodies_[static_cast<size_t>(j)];
      Slope safe, sight;
      const double a0 = SafetyDistance(body, flat.p, &safe.p);
      const double d = SightDistance(body, flat.p, instant.target, &sight.p);
      safe.p *= -1.0;
      sight.p *= -1.0;
      put(instant, 1.0 + parameters_.margin - a0, safe);
      put(instant, 1.0 + parameters_.margin - d, sight);
    }
  }
}

}  // namespace chase::baselines
