// Problems and what is made of them, against samples: ellipsoids that stand for themselves, boxes
// about curves, more room.

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "services/planning/margins.h"
#include "services/planning/problem.h"

namespace chase::planning {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Random = std::mt19937;

constexpr int kInstants = 96;

double Uniform(Random& g, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(g);
}

Vector3d Somewhere(Random& g, double x, double y, double z) {
  const double a = Uniform(g, -x, x), b = Uniform(g, -y, y);
  return {a, b, Uniform(g, -z, z)};
}

Curve RandomCurve(Random& g, int rows) {
  Curve c(rows, 3);
  for (Eigen::Index i = 0; i < c.size(); ++i) c.data()[i] = Uniform(g, -1.0, 1.0);
  return c;
}

Matrix3d RandomShape(Random& g) {
  const Eigen::Quaterniond q(Uniform(g, -1, 1), Uniform(g, -1, 1), Uniform(g, -1, 1),
                             Uniform(g, -1, 1));
  const Matrix3d R = q.normalized().toRotationMatrix();
  const Vector3d radii(Uniform(g, 0.2, 1.0), Uniform(g, 0.2, 1.0), Uniform(g, 0.2, 1.0));
  const Matrix3d shape = R * radii.cwiseAbs2().cwiseInverse().asDiagonal() * R.transpose();
  return 0.5 * (shape + shape.transpose());
}

/// A drone behind a target that walks, and ellipsoids between and about them.
PlanRequest RandomRequest(Random& g) {
  PlanRequest r;
  r.t0 = 1.0;
  r.start.p = {-2.5, 0.0, 1.3};
  r.start.v = Somewhere(g, 1.0, 1.0, 0.2);
  r.target = {r.t0, r.horizon, Eigen::MatrixXd::Zero(2, 3)};
  r.target.coefficients << 0.0, 0.0, 0.8, Uniform(g, -2, 2), Uniform(g, -2, 2), 0.0;
  r.target_sigma = Uniform(g, 0.0, 0.1);
  for (int i = 0; i < 6; ++i) {
    world::Obstacle o;
    o.id = i;
    o.shape = RandomShape(g);
    o.center = world::Trajectory::Constant(Vector3d(-1.2, 0.0, 1.1) + Somewhere(g, 2.5, 2.0, 1.0),
                                           r.t0 - 0.1, 1.0);
    if (i % 2) o.position_covariance.diagonal().setConstant(Uniform(g, 0.0, 0.003));
    r.obstacles.push_back(o);
  }
  return r;
}

/// Least of x' R x along target - centre.
double LeastOfTarget(const Problem& problem, const Ellipsoid& e, const Matrix3d& R) {
  double least = HUGE_VAL;
  for (int i = 0; i <= kInstants; ++i) {
    const double tau = 1.0 * i / kInstants;
    least =
        std::min(least, SquaredNorm(R, Evaluate(problem.target, tau) - Evaluate(e.center, tau)));
  }
  return least;
}

// Ellipsoids that stand for themselves: of each margin the largest quarter that leaves out the
// start, the target and the first line of sight.
TEST(Problem, MarginsOfEllipsoidsGiveWayByQuarters) {
  PlannerConfig c;
  c.minkowski_sums = false;
  c.safety_margin = 0.2;
  c.sight_margin = 0.4;
  constexpr double kOff = 1.03;  // what is that far out counts as out
  Random g(3);
  int given = 0, inside = 0, less = 0, hidden = 0, blocked = 0;
  for (int i = 0; i < 600; ++i) {
    const PlanRequest request = RandomRequest(g);
    const Problem problem = MakeProblem(c, request, nullptr);
    for (const Ellipsoid& e : problem.obstacles) {
      const world::Obstacle& o = request.obstacles[static_cast<size_t>(e.id)];
      const double unsure = c.sigmas * std::sqrt(o.position_covariance(0, 0));
      const Vector3d p = problem.start.row(0).transpose(), q = problem.target.row(0).transpose();
      const Vector3d center = e.center.row(0).transpose();
      const auto start = [&](double share) {
        const double by = c.hard_radius() + share * c.safety_margin + unsure;
        return SquaredNorm(world::Inflated(o.shape, by), p - center);
      };
      const double share = (e.safety_radius - c.hard_radius()) / c.safety_margin;
      EXPECT_NEAR(4.0 * share, std::round(4.0 * share), 1e-9);
      if (e.safety_from > 0.0) {
        EXPECT_LE(start(0.0), kOff);
        EXPECT_EQ(e.safety_from, kLeaveBy);
        ++inside;
      } else {
        EXPECT_GT(start(share), 1.0);
        EXPECT_TRUE(share > 0.99 || start(share + 0.25) <= kOff);
        EXPECT_TRUE(e.safety.isApprox(world::Inflated(o.shape, e.safety_radius + unsure), 1e-9));
        given += share < 1.0;
      }
      const auto shape = [&](double by) {
        const double grown = by * (c.sight_margin + 0.5 * problem.target_growth.sum() + unsure);
        return grown > 0.0 ? world::Inflated(o.shape, grown) : o.shape;
      };
      const auto target = [&](double by) { return LeastOfTarget(problem, e, shape(by)); };
      const auto sight = [&](double by) {
        return world::SegmentSquaredDistance(p, q, center, shape(by));
      };
      if (e.sight_from > 0.0) {
        EXPECT_LE(target(0.0), 1.0);
        ++hidden;
        continue;
      }
      EXPECT_TRUE(e.sight.isApprox(shape(e.sight_share), 1e-9));
      EXPECT_GT(target(e.sight_share), e.sight_share > 0.0 ? 1.005 : 0.99);
      const bool block = sight(e.sight_share) < 1.0;
      blocked += block;
      EXPECT_TRUE(!block || sight(0.0) <= kOff);
      if (e.sight_share == 1.0) continue;
      ++less;
      const double more = e.sight_share + 0.25;
      EXPECT_TRUE(target(more) <= kOff || (!block && sight(more) <= kOff)) << e.sight_share;
    }
  }
  for (const int n : {given, inside, less, hidden, blocked}) EXPECT_GT(n, 20);
}

// Sight may be asked for without a margin, and safety with one.
TEST(Problem, ShapesOfSafetyAndSightGrowEachByItsOwnMargin) {
  Random g(5);
  PlannerConfig c;
  for (const double margin : {0.1, 0.0}) {
    c.sight_margin = margin;
    PlanRequest request = RandomRequest(g);
    request.target_sigma = request.target_speed_sigma = 0.0;
    request.target_manoeuvre = {};
    request.obstacles.resize(1);
    world::Obstacle& o = request.obstacles[0];
    o.center = world::Trajectory::Constant({50.0, 0.0, 1.0}, 0.0, 1.0);  // where nothing gives way
    o.position_covariance.setZero();
    const Ellipsoid e = MakeProblem(c, request, nullptr).obstacles[0];
    const auto grown = [&](double by) { return by > 0.0 ? world::Inflated(o.shape, by) : o.shape; };
    EXPECT_LT((e.safety - grown(c.hard_radius() + c.safety_margin)).norm(), 1e-9);
    EXPECT_LT((e.sight - grown(c.sight_margin)).norm(), 1e-9) << margin;
  }
}

TEST(Problem, BoxesAboutACurveHoldItAndLittleMore) {
  Random g(4);
  for (int i = 0; i < 300; ++i) {
    const Curve curve = RandomCurve(g, 1 + static_cast<int>(g() % 7));
    const Hull hull(curve);
    ASSERT_TRUE(hull.has_boxes);
    for (int k = 0; k <= kInstants; ++k) {
      const Eigen::Array3d x = Evaluate(curve, 1.0 * k / kInstants).array();
      EXPECT_TRUE((x >= hull.whole.low).all() && (x <= hull.whole.high).all());
      const Box& quarter = hull.quarters[std::min(3, 4 * k / kInstants)];
      EXPECT_TRUE((x >= quarter.low).all() && (x <= quarter.high).all());
      EXPECT_TRUE((quarter.low >= hull.whole.low - 1e-9).all());
      EXPECT_TRUE((quarter.high <= hull.whole.high + 1e-9).all());
    }
    // Nairn, Peters & Lutterkort 1999: by no more than 3/4 of the second differences, which a
    // quarter has a sixteenth of.
    const Points b = ToPoints(curve, 6);
    const Eigen::Array3d bend = (b.bottomRows<5>() - 2.0 * b.middleRows<5>(1) + b.topRows<5>())
                                    .cwiseAbs()
                                    .colwise()
                                    .maxCoeff();
    for (int k = 0; k < 4; ++k) {
      Eigen::Array3d low = Eigen::Array3d::Constant(HUGE_VAL), high = -low;
      for (int j = 0; j <= kInstants; ++j) {
        const Eigen::Array3d x = Evaluate(curve, (k + 1.0 * j / kInstants) / 4.0).array();
        low = low.min(x), high = high.max(x);
      }
      const Eigen::Array3d beyond = 0.75 / 16.0 * bend + 1e-3;
      EXPECT_TRUE((hull.quarters[k].low >= low - beyond).all());
      EXPECT_TRUE((hull.quarters[k].high <= high + beyond).all());
    }
  }
  EXPECT_FALSE(Hull(RandomCurve(g, 8)).has_boxes);
}

// Quick answers are right, and there are some.
TEST(Problem, WhatIsPlainlyOutsideIsOutside) {
  Random g(5);
  int outside = 0, inside = 0;
  for (int i = 0; i < 2000; ++i) {
    const Curve curve = RandomCurve(g, 1 + static_cast<int>(g() % 8));
    Curve center = Curve::Zero(2, 3);
    center.row(0) = Somewhere(g, 3.0, 3.0, 3.0).transpose();
    center.row(1) = Somewhere(g, 0.5, 0.5, 0.5).transpose();
    const Eigen::Array3d half = Somewhere(g, 1.0, 1.0, 1.0).cwiseAbs().array() + 0.1;
    const Hull hull(curve);
    bool touches = false;
    for (int k = 0; k <= kInstants; ++k) {
      const double tau = 1.0 * k / kInstants;
      const Vector3d d = Evaluate(curve, tau) - Evaluate(center, tau);
      touches = touches || (d.array().abs() < half).all();
    }
    const bool plain = IsPlainlyOutside(hull, center, half);
    EXPECT_FALSE(plain && touches) << i;
    EXPECT_FALSE(plain && curve.rows() > 7);
    outside += plain;
    inside += touches;
  }
  EXPECT_GT(outside, 200);
  EXPECT_GT(inside, 30);
}

TEST(Problem, SightAtTheStartIsTheSegment) {
  Random g(6);
  int beyond = 0;
  for (int i = 0; i < 1000; ++i) {
    Problem problem;
    problem.start = RandomCurve(g, 4);
    problem.target = RandomCurve(g, 3);
    const Matrix3d R = RandomShape(g);
    const Curve center = 2.0 * RandomCurve(g, 2);
    const FirstSight first(problem);
    const bool is_beyond = first.IsBeyond(center, R, HalfSidesOf(R), kClear);
    const double least = world::SegmentSquaredDistance(problem.start.row(0).transpose(),
                                                       problem.target.row(0).transpose(),
                                                       center.row(0).transpose(), R);
    EXPECT_TRUE(is_beyond == (least > kClear) || least > kClear) << i;
    EXPECT_TRUE(is_beyond || least <= kClear) << i;
    beyond += is_beyond;
  }
  EXPECT_GT(beyond, 200);
}

// The same problem with larger shapes: those about start, target and first sight stay as they were.
TEST(Problem, MoreRoomIsTakenWhereThereIsSome) {
  const PlannerConfig c;
  Random g(7);
  int grown = 0, kept = 0;
  Problem roomy;  // of the one before there is nothing left
  for (int i = 0; i < 100; ++i) {
    PlanRequest request = RandomRequest(g);
    request.target_body = request.obstacles.back();
    Problem problem = MakeProblem(c, request, nullptr);
    if (i % 2) {
      problem.reach = Box{Eigen::Array3d::Constant(-9.0), Eigen::Array3d::Constant(9.0)};
      problem.near = {1, 3, 4};
    }
    for (const double room : {0.0, 0.1}) {
      Enlargements memory;
      WithRoom(problem, room, &memory, &roomy);
      EXPECT_EQ(roomy.t0, problem.t0);
      EXPECT_EQ(roomy.duration, problem.duration);
      EXPECT_EQ(roomy.degree, problem.degree);
      EXPECT_EQ(roomy.start, problem.start);
      EXPECT_EQ(roomy.target, problem.target);
      EXPECT_EQ(roomy.sigmas, problem.sigmas);
      EXPECT_EQ(roomy.sight_radius, problem.sight_radius);
      EXPECT_EQ(roomy.target_growth, problem.target_growth);
      EXPECT_EQ(roomy.limits.speed, problem.limits.speed);
      EXPECT_EQ(roomy.limits.z_min, problem.limits.z_min);
      EXPECT_EQ(roomy.target_body->safety_radius, problem.target_body->safety_radius);
      EXPECT_EQ(roomy.reach.has_value(), problem.reach.has_value());
      const size_t n = problem.reach ? problem.near.size() : problem.obstacles.size();
      ASSERT_EQ(roomy.obstacles.size(), n);
      ASSERT_EQ(roomy.near.size(), n);
      for (size_t k = 0; k < n; ++k) {
        const size_t j = problem.reach ? static_cast<size_t>(problem.near[k]) : k;
        const Ellipsoid &e = roomy.obstacles[k], &before = problem.obstacles[j];
        EXPECT_EQ(roomy.near[k], static_cast<int>(k));
        EXPECT_EQ(e.id, before.id);
        EXPECT_EQ(e.safety_radius, before.safety_radius);
        const Vector3d p = problem.start.row(0).transpose() - e.center.row(0).transpose();
        const Vector3d q = problem.target.row(0).transpose() - e.center.row(0).transpose();
        Enlargements other;
        const Matrix3d safety = other.Of(0, before.safety, 0.1).shape;
        const Matrix3d sight = other.Of(1, before.sight, 0.1).shape;
        const double start = SquaredNorm(safety, p);
        const double seen = std::min(LeastOfTarget(problem, e, sight),
                                     world::SegmentSquaredDistance(p, q, Vector3d::Zero(), sight));
        EXPECT_TRUE(e.safety == before.safety || (room > 0.0 && start > 1.0));
        EXPECT_TRUE(e.sight == before.sight || (room > 0.0 && seen > 0.99));
        EXPECT_TRUE(e.safety == safety || room == 0.0 || start < 1.03);
        EXPECT_TRUE(e.sight == sight || room == 0.0 || seen < 1.05);
        for (int a = 0; a < 3; ++a) {
          EXPECT_GE(e.safety_half[a], before.safety_half[a]);
          EXPECT_GE(e.sight_half[a], before.sight_half[a]);
          EXPECT_GE(1.001 * e.safety_half[a], std::sqrt(Matrix3d(e.safety.inverse())(a, a)));
          EXPECT_GE(1.001 * e.sight_half[a], std::sqrt(Matrix3d(e.sight.inverse())(a, a)));
        }
        grown += room > 0.0 && seen > 1.05 && start > 1.03;
        kept += room > 0.0 && (seen < 0.99 || start < 1.0);
      }
    }
  }
  EXPECT_GT(grown, 50);
  EXPECT_GT(kept, 10);
}

TEST(Problem, NothingOfAnEarlierOneStays) {
  PlannerConfig c;
  Random g(8);
  Problem used;
  PlanRequest request;
  for (int i = 0; i < 200; ++i) {
    if (i % 4 == 0) {
      request = RandomRequest(g);
      if (i % 3 == 0) request.target_body = request.obstacles.back();
      if (i % 16 == 0) request.asks_sight = false;
      if (i % 5 == 0) request.obstacles.resize(g() % 5);
    }
    c.safety_margin = i % 4 > 0 ? 0.2 : 0.1;  // the same with other margins
    c.sight_margin = i % 4 > 1 ? 0.2 : 0.1;
    if (i % 4 == 3) {  // and from where nothing gives way
      request.start.p.y() += 20.0;
      request.target.coefficients(0, 1) += 20.0;
    }
    for (size_t k = 0; k < request.obstacles.size(); k += 3) {
      world::Obstacle& o = request.obstacles[k];
      o.solid = world::Obstacle::Solid::kBox;
      o.half = Vector3d(0.3, 0.2, 0.3) * (i % 8 < 6 ? 1.0 : 0.9);  // in the same ellipsoid
    }
    used.reach = Box{Eigen::Array3d::Zero(), Eigen::Array3d::Zero()};
    used.skeletons = {{Vector3d::Zero()}};
    MakeProblem(c, request, request, nullptr, &used);
    const Problem fresh = MakeProblem(c, request, nullptr);
    EXPECT_FALSE(used.reach);
    EXPECT_TRUE(used.skeletons.empty());
    EXPECT_EQ(used.n_candidates(), 1);
    EXPECT_EQ(used.target_body.has_value(), request.target_body.has_value());
    ASSERT_EQ(used.obstacles.size(), request.obstacles.size());
    for (size_t k = 0; k < fresh.obstacles.size(); ++k) {
      const Ellipsoid &a = used.obstacles[k], &b = fresh.obstacles[k];
      EXPECT_EQ(a.id, request.obstacles[k].id);
      EXPECT_EQ(a.index, static_cast<int>(k));
      EXPECT_EQ(a.safety, b.safety);
      EXPECT_TRUE(!request.asks_sight || a.sight == b.sight);
      EXPECT_EQ(a.safety_from, b.safety_from);
      EXPECT_EQ(a.sight_from, b.sight_from);
      EXPECT_EQ(a.safety_radius, b.safety_radius);
      EXPECT_EQ(a.sight_share, b.sight_share);
      EXPECT_EQ(a.center, b.center);
      EXPECT_EQ(a.body->shape, b.body->shape);
      EXPECT_TRUE(request.asks_sight || a.sight_from == 1.0);
    }
  }
}

// Closed form against differences.
TEST(Problem, DerivativesOfACurveAreThoseOfDifferences) {
  Random g(9);
  constexpr double kStep = 1e-4;
  for (int i = 0; i < 200; ++i) {
    const Curve curve = RandomCurve(g, 1 + static_cast<int>(g() % 7));
    const double tau = Uniform(g, 0.1, 0.9);
    for (int order = 1; order <= 3; ++order) {
      const Vector3d difference =
          (Evaluate(curve, tau + kStep, order - 1) - Evaluate(curve, tau - kStep, order - 1)) /
          (2.0 * kStep);
      EXPECT_LT((Evaluate(curve, tau, order) - difference).norm(), 1e-4) << order;
    }
    EXPECT_LT((Evaluate(curve, 1.0) - Vector3d(curve.colwise().sum().transpose())).norm(), 1e-12);
  }
}

}  // namespace
}  // namespace chase::planning
