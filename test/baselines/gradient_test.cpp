// Gradients of the optimising rivals against central differences.

#include <gtest/gtest.h>

#include <cmath>

#include "common/world/random.h"
#include "test/baselines/naegeli_style/framing_nlp.h"
#include "test/baselines/penin_style/tracking_nlp.h"

namespace chase::baselines {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kStep = 1e-5;

Vector3d RandomVector(world::Random* random, double size) {
  return {random->Uniform(-size, size), random->Uniform(-size, size), random->Uniform(-size, size)};
}

template <class F>
Vector3d Difference(F f, const Vector3d& x) {
  Vector3d slope;
  for (int i = 0; i < 3; ++i) {
    const Vector3d e = kStep * Vector3d::Unit(i);
    slope[i] = (f(x + e) - f(x - e)) / (2.0 * kStep);
  }
  return slope;
}

void ExpectNear(const Vector3d& a, const Vector3d& b, const char* what) {
  EXPECT_LT((a - b).norm(), 1e-6 * std::max(1.0, b.norm()))
      << what << ": " << a.transpose() << " instead of " << b.transpose();
}

Body RandomBody(world::Random* random) {
  const double a = random->Uniform(0.5, 0.9);
  return {RandomVector(random, 2.0), Vector3d(1 / (a * a), 1 / (a * a), 1 / 36.0).asDiagonal(),
          a - 0.3};
}

TEST(Gradients, DistancesToBodies) {
  world::Random random(1);
  for (int i = 0; i < 300; ++i) {
    const Body body = RandomBody(&random);
    const Vector3d p = RandomVector(&random, 4.0), q = RandomVector(&random, 4.0);
    const Vector3d u = q - p;
    const double s = (body.center - p).dot(body.R * u) / u.dot(body.R * u);
    if (std::abs(s) < 0.01 || std::abs(s - 1.0) < 0.01) continue;  // the kinks
    Vector3d slope;
    SightDistance(body, p, q, &slope);
    const auto sight = [&](const Vector3d& x) { return SightDistance(body, x, q, nullptr); };
    ExpectNear(slope, Difference(sight, p), "sight");
    SafetyDistance(body, p, &slope);
    const auto safety = [&](const Vector3d& x) { return SafetyDistance(body, x, nullptr); };
    ExpectNear(slope, Difference(safety, p), "safety");
  }
}

TEST(Gradients, CameraOfPeninStyle) {
  world::Random random(2);
  for (int i = 0; i < 300; ++i) {
    const Vector3d u = RandomVector(&random, 3.0) + Vector3d(2.0, 0.0, 0.0);
    const Vector3d a = RandomVector(&random, 3.0), w = RandomVector(&random, 1.0);
    if (u.head<2>().norm() < 0.6) continue;  // near the floor of the bearing's rate
    Vector3d dp, da, dv;
    ImageElevation(u, a, &dp, &da);
    ExpectNear(dp,
               -Difference(
                   [&](const Vector3d& x) {
                     Vector3d m, n;
                     return ImageElevation(x, a, &m, &n);
                   },
                   u),
               "elevation, p");
    ExpectNear(da,
               Difference(
                   [&](const Vector3d& x) {
                     Vector3d m, n;
                     return ImageElevation(u, x, &m, &n);
                   },
                   a),
               "elevation, a");
    AxisCosine(u, a, &dp, &da);
    ExpectNear(dp,
               -Difference(
                   [&](const Vector3d& x) {
                     Vector3d m, n;
                     return AxisCosine(x, a, &m, &n);
                   },
                   u),
               "axis, p");
    ExpectNear(da,
               Difference(
                   [&](const Vector3d& x) {
                     Vector3d m, n;
                     return AxisCosine(u, x, &m, &n);
                   },
                   a),
               "axis, a");
    BearingRate(u, w, &dp, &dv);
    ExpectNear(dp,
               -Difference(
                   [&](const Vector3d& x) {
                     Vector3d m, n;
                     return BearingRate(x, w, &m, &n);
                   },
                   u),
               "bearing, p");
    ExpectNear(dv,
               -Difference(
                   [&](const Vector3d& x) {
                     Vector3d m, n;
                     return BearingRate(u, x, &m, &n);
                   },
                   w),
               "bearing, v");
  }
}

/// The camera's axis by its definition, with vectors only.
TEST(Camera, AxisIsNormalToThrustAndTurnedToTheTarget) {
  world::Random random(3);
  for (int i = 0; i < 100; ++i) {
    const Vector3d u = RandomVector(&random, 3.0), a = RandomVector(&random, 3.0);
    if (u.head<2>().norm() < 0.1) continue;
    const Vector3d n = (a + Vector3d(0, 0, 9.81)).normalized();
    const Vector3d heading = Vector3d(u.x(), u.y(), 0.0).normalized();
    const Vector3d axis = (heading - heading.dot(n) * n).normalized();
    Vector3d dp, da;
    EXPECT_NEAR(AxisCosine(u, a, &dp, &da), axis.dot(u.normalized()), 1e-9);
  }
}

planning::PlanRequest CrowdedRequest() {
  planning::PlanRequest request;
  request.horizon = 5.0;
  request.start.p = {-3.0, 0.2, 1.3};
  request.start.v = {0.9, 0.1, 0.0};
  request.start.a = {0.1, -0.2, 0.05};
  request.target = {0.0, 5.0, Eigen::MatrixXd::Zero(3, 3)};
  request.target.coefficients << 0, 0, 1, 5, 0, 0, 0, 1.5, 0;
  int id = 0;
  for (const auto& [x, y] : {std::pair{0.5, 1.2}, {1.5, -1.0}, {-1.0, -1.1}, {3.5, 2.2}}) {
    world::Obstacle o;
    o.id = id++;
    o.center = world::Trajectory::Constant({x, y, 1.0}, 0.0, 5.0);
    o.shape = Vector3d(6.0, 6.0, 0.03).asDiagonal();
    request.obstacles.push_back(o);
  }
  return request;
}

planning::PlannerConfig Config() {
  planning::PlannerConfig config;
  config.drone_radius = 0.3;
  config.desired_distance = 3.0;
  config.max_speed = 3.0;
  config.max_acceleration = 5.0;
  return config;
}

/// Cost and Jacobian at x along every variable.
void ExpectConsistent(const Nlp& nlp, const VectorXd& x) {
  const int n = nlp.n_variables(), m = nlp.n_constraints();
  VectorXd slope = VectorXd::Zero(n), g = VectorXd::Zero(m);
  Nlp::Rows rows = Nlp::Rows::Zero(m, n);
  nlp.Cost(x, &slope);
  nlp.Constraints(x, &g, &rows);
  for (int i = 0; i < n; ++i) {
    VectorXd high = x, low = x, g_high = VectorXd::Zero(m), g_low = VectorXd::Zero(m);
    high[i] += kStep;
    low[i] -= kStep;
    const double by_difference = (nlp.Cost(high, nullptr) - nlp.Cost(low, nullptr)) / (2 * kStep);
    EXPECT_NEAR(slope[i], by_difference, 1e-6 * std::max(10.0, slope.norm())) << "variable " << i;
    nlp.Constraints(high, &g_high, nullptr);
    nlp.Constraints(low, &g_low, nullptr);
    const VectorXd column = (g_high - g_low) / (2 * kStep);
    Eigen::Index worst = 0;
    const double off = (rows.col(i) - column).cwiseAbs().maxCoeff(&worst);
    EXPECT_LT(off, 1e-5 * std::max(1.0, column.norm())) << "variable " << i << ", row " << worst;
  }
}

TEST(Gradients, TrackingNlpOfPeninStyle) {
  const auto request = CrowdedRequest();
  const Spline spline(request.horizon);
  world::Random random(4);
  VectorXd x(3 * Spline::kFree);
  for (int i = 0; i < Spline::kFree; ++i) {
    const double t = spline.duration() * (i + 4) / (Spline::kControls - 1.0);
    x.segment<3>(3 * i) =
        request.target.Position(t) + Vector3d(-3.0, 0.3, 0.3) + RandomVector(&random, 0.3);
  }
  const TrackingNlp nlp({}, Config(), request, spline, x);
  EXPECT_GT(nlp.n_constraints(), 8 * 25);  // some obstacles are near
  ExpectConsistent(nlp, x);
}

TEST(Gradients, FramingNlpOfNaegeliStyle) {
  const auto request = CrowdedRequest();
  world::Random random(5);
  VectorXd x(61);
  for (int i = 0; i < 20; ++i) x.segment<3>(3 * i) = RandomVector(&random, 0.4);
  x[60] = 0.1;
  const FramingNlp nlp({}, Config(), request, x);
  EXPECT_GT(nlp.n_constraints(), 8 * 20);
  ExpectConsistent(nlp, x);
}

TEST(Spline, PiecesAreTheSplineAndItBeginsAsAsked) {
  world::Random random(6);
  const Spline spline(5.0);
  const world::State start{RandomVector(&random, 3.0), RandomVector(&random, 1.0),
                           RandomVector(&random, 1.0), RandomVector(&random, 1.0)};
  Spline::Controls controls;
  for (int i = 0; i < Spline::kControls; ++i)
    controls.row(i) = RandomVector(&random, 5.0).transpose();
  controls.topRows<Spline::kFixed>() = spline.Fixed(start);
  const Pieces pieces = spline.ToPieces(controls, 2.0);
  EXPECT_NEAR(EndOf(pieces), 7.0, 1e-12);
  const world::State first = StateAt(pieces, 2.0);
  EXPECT_LT((first.p - start.p).norm() + (first.v - start.v).norm(), 1e-9);
  EXPECT_LT((first.a - start.a).norm() + (first.j - start.j).norm(), 1e-8);
  for (double t = 0.0; t < 5.0; t += 0.13) {
    const Vector3d p = (spline.Basis(t, 0) * controls).transpose();
    EXPECT_LT((StateAt(pieces, 2.0 + t).p - p).norm(), 1e-9) << t;
    const Vector3d ahead = (spline.Basis(t + kStep, 2) * controls).transpose(),
                   behind = (spline.Basis(std::max(0.0, t - kStep), 2) * controls).transpose();
    const Vector3d jerk = (spline.Basis(t, 3) * controls).transpose();
    if (t > kStep) {
      EXPECT_LT(((ahead - behind) / (2 * kStep) - jerk).norm(), 1e-3) << t;
    }
  }
  double jerk = 0.0;  // the Gram matrix against summing
  constexpr int kSamples = 20000;
  for (int i = 0; i < kSamples; ++i)
    jerk += 5.0 / kSamples * (spline.Basis(5.0 * (i + 0.5) / kSamples, 3) * controls).squaredNorm();
  EXPECT_NEAR((controls.transpose() * spline.Gram(3) * controls).trace() / jerk, 1.0, 1e-5);
}

}  // namespace
}  // namespace chase::baselines
