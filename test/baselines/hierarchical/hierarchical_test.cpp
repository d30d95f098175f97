#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "common/world/random.h"
#include "test/baselines/hierarchical/corridor.h"
#include "test/baselines/hierarchical/quadratic_program.h"
#include "test/baselines/hierarchical/view_graph.h"

namespace chase::baselines {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

MatrixXd RandomMatrix(world::Random* random, int rows, int columns) {
  MatrixXd m(rows, columns);
  for (int i = 0; i < m.size(); ++i) m.data()[i] = random->Uniform(-1.0, 1.0);
  return m;
}

QuadraticProgram RandomProgram(world::Random* random) {
  constexpr int kVariables = 5, kEqualities = 1, kInequalities = 8;
  const MatrixXd root = RandomMatrix(random, kVariables, kVariables);
  return {root * root.transpose() + 0.1 * MatrixXd::Identity(kVariables, kVariables),
          RandomMatrix(random, kVariables, 1),
          RandomMatrix(random, kEqualities, kVariables),
          RandomMatrix(random, kEqualities, 1),
          RandomMatrix(random, kInequalities, kVariables),
          RandomMatrix(random, kInequalities, 1)};
}

double Value(const QuadraticProgram& qp, const VectorXd& x) {
  return 0.5 * x.dot(qp.H * x) + qp.g.dot(x);
}

/// Best feasible stationary point over every subset of inequalities held with equality.
double ByEnumeration(const QuadraticProgram& qp) {
  double best = HUGE_VAL;
  const int n = static_cast<int>(qp.H.rows()), m = static_cast<int>(qp.C.rows());
  for (int subset = 0; subset < (1 << m); ++subset) {
    std::vector<int> held;
    for (int i = 0; i < m; ++i)
      if (subset >> i & 1) held.push_back(i);
    const int k = static_cast<int>(qp.A.rows() + static_cast<Eigen::Index>(held.size()));
    if (k > n) continue;
    MatrixXd K = MatrixXd::Zero(n + k, n + k);
    VectorXd rhs = VectorXd::Zero(n + k);
    K.topLeftCorner(n, n) = qp.H;
    rhs.head(n) = -qp.g;
    for (int i = 0; i < k; ++i) {
      const bool equality = i < qp.A.rows();
      const int row = equality ? i : held[static_cast<size_t>(i - qp.A.rows())];
      K.row(n + i).head(n) = equality ? qp.A.row(row) : qp.C.row(row);
      rhs[n + i] = equality ? qp.b[row] : qp.d[row];
    }
    K.topRightCorner(n, k) = K.bottomLeftCorner(k, n).transpose();
    const VectorXd x = K.fullPivLu().solve(rhs).head(n);
    if ((qp.C * x - qp.d).minCoeff() > -1e-7 && (qp.A * x - qp.b).cwiseAbs().maxCoeff() < 1e-7)
      best = std::min(best, Value(qp, x));
  }
  return best;
}

TEST(QuadraticProgram, EqualsEnumerationOfActiveSets) {
  world::Random random(7);
  int solved = 0, refused = 0;
  for (int i = 0; i < 150; ++i) {
    const QuadraticProgram qp = RandomProgram(&random);
    const double best = ByEnumeration(qp);
    const auto x = Solve(qp);
    ASSERT_EQ(x.has_value(), std::isfinite(best)) << "program " << i;
    ++(x ? solved : refused);
    if (!x) continue;
    EXPECT_GT((qp.C * *x - qp.d).minCoeff(), -1e-7);
    EXPECT_LT((qp.A * *x - qp.b).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_NEAR(Value(qp, *x), best, 1e-7 * std::max(1.0, std::abs(best)));
  }
  EXPECT_GT(solved, 30);
  EXPECT_GT(refused, 5);
}

TEST(Corridor, StaysInItsBoxesAndIsSmooth) {
  const HierarchicalParameters p;
  const world::State start{{0, 0, 1}, {1.0, 0.3, 0}, {0.2, -0.1, 0}, {0, 0, 0}};
  const std::vector<Vector3d> waypoints = {{0, 0, 1},      {1, 0.3, 1.2}, {2, 0.0, 1.2},
                                           {2.9, -0.4, 1}, {3.8, 0, 1},   {5, 0.2, 1.3}};
  const auto plan = SmoothCorridor(p, start, waypoints, 3.0, 5.0);
  ASSERT_TRUE(plan);
  const world::State s = plan->front().At(3.0);
  EXPECT_LT((s.p - start.p).norm() + (s.v - start.v).norm() + (s.a - start.a).norm(), 1e-8);
  for (size_t i = 0; i + 1 < plan->size(); ++i)
    for (int order = 0; order <= 2; ++order) {
      const double t = (*plan)[i].end();
      EXPECT_LT(((*plan)[i].Derivative(order, t) - (*plan)[i + 1].Derivative(order, t)).norm(),
                1e-7);
    }
  for (size_t leg = 0; leg < 5; ++leg)
    for (int k = 1; k <= 3; ++k) {
      const Vector3d line = waypoints[leg] + k / 4.0 * (waypoints[leg + 1] - waypoints[leg]);
      const Vector3d off = (*plan)[leg].Position(3.0 + static_cast<double>(leg) + k / 4.0) - line;
      EXPECT_LT(off.cwiseAbs().maxCoeff(), p.corridor + 1e-6);
    }
}

TEST(Corridor, TooFastForItsBoxesIsRefused) {
  const world::State start{{0, 0, 1}, {0, 9.0, 0}, {0, 0, 0}, {0, 0, 0}};
  HierarchicalParameters narrow;
  narrow.corridor = 0.01;
  narrow.corridor_points = 12;
  EXPECT_FALSE(SmoothCorridor(narrow, start, {{0, 0, 1}, {1, 0, 1}, {2, 0, 1}}, 0.0, 2.0));
}

std::vector<world::Obstacle> Pillars() {
  std::vector<world::Obstacle> obstacles;
  for (const auto& [x, y] :
       {std::pair{1.0, 1.3}, {2.0, -1.2}, {-1.0, -1.4}, {4.0, 1.5}, {-2.5, 1.8}}) {
    world::Obstacle o;
    o.center = world::Trajectory::Constant({x, y, 1.0}, 0.0, 5.0);
    o.shape = Vector3d(1 / 0.16, 1 / 0.16, 0.03).asDiagonal();
    obstacles.push_back(o);
  }
  return obstacles;
}

double Clearance(const Vector2d& p) {
  double least = HUGE_VAL;
  for (const auto& o : Pillars())
    least = std::min(least, (p - o.center.coefficients.row(0).head<2>().transpose()).norm() - 0.4);
  return least;
}

TEST(DistanceField, IsTheDistanceToTheNearestPillar) {
  const DistanceField field(Pillars(), 0.15, 2.0);
  world::Random random(8);
  for (int i = 0; i < 2000; ++i) {
    const Vector2d p(random.Uniform(-8, 8), random.Uniform(-8, 8));
    if (Clearance(p) < 0.0) continue;  // bilinear inside a small pillar is coarse
    EXPECT_NEAR(field.At(p), std::min(2.0, Clearance(p)), 0.075) << "half a cell";
  }
  EXPECT_TRUE(field.IsOf(Pillars()));
  EXPECT_FALSE(field.IsOf({}));
}

TEST(ViewGraph, NodesAndEdgesKeepWhatIsAsked) {
  const HierarchicalParameters p;
  const DistanceField field(Pillars(), p.field_cell, p.field_cut);
  std::vector<Vector3d> targets;
  for (int k = 1; k <= 5; ++k) targets.emplace_back(1.0 * k, 0.1 * k, 1.0);
  const auto way = CheapestViews(p, field, {-2.8, 0.0, 1.2}, targets, 1.0);
  ASSERT_EQ(way.size(), 6u);
  for (size_t k = 1; k < way.size(); ++k) {
    const double distance = (way[k] - targets[k - 1]).norm();
    EXPECT_GT(distance, p.min_distance);
    EXPECT_LT(distance, p.max_distance);
    EXPECT_LT((way[k] - way[k - 1]).norm(), p.connect);
    for (double s = 0.0; s <= 1.0; s += 0.01) {
      EXPECT_GT(Clearance((way[k] + s * (targets[k - 1] - way[k])).head<2>()), p.min_sight - 0.04);
      EXPECT_GT(Clearance((way[k - 1] + s * (way[k] - way[k - 1])).head<2>()), p.safe - 0.04);
    }
  }
}

TEST(ViewGraph, NoWayWhenTheTargetIsOutOfReach) {
  const HierarchicalParameters p;
  const DistanceField field(Pillars(), p.field_cell, p.field_cut);
  EXPECT_TRUE(CheapestViews(p, field, {-30.0, 0.0, 1.2}, {{0, 0, 1}, {1, 0, 1}}, 1.0).empty());
}

}  // namespace
}  // namespace chase::baselines
