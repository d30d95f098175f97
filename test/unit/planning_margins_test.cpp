#include <gtest/gtest.h>

#include "services/planning/margins.h"
#include "test/unit/planning_minkowski.h"

// What a problem asks of plans about each obstacle: no margin gives way further than it must.

namespace chase::planning {
namespace {

using namespace minkowski;

/// Half the extent of body and uncertainty along an axis.
double Extent(const world::Body& body, int axis, double tau) {
  const Vector3d n = Vector3d::Unit(axis);
  return n.dot(world::SupportPoint(body, n)) + body.sigmas * world::Deviation(body, n, tau);
}

/// Boxes that sort out obstacles hold what the proofs are about, and little more.
void ExpectBoxes(const PlannerConfig& c, const Problem& problem, const Ellipsoid& e,
                 const world::Body& body) {
  const double most = std::sqrt(std::max(
      body.covariance[0].diagonal().maxCoeff(),
      (body.covariance[0] + body.covariance[1] + body.covariance[2]).diagonal().maxCoeff()));
  for (int a = 0; a < 3; ++a) {
    const double solid = Vector3d::Unit(a).dot(world::SupportPoint(body, Vector3d::Unit(a)));
    for (const double tau : {0.0, 0.3, 0.7, 1.0}) {
      const double seen = math::Evaluate(problem.target_growth, tau);
      EXPECT_GE(e.safety_half[a] + 1e-9, Extent(body, a, tau) + c.hard_radius() + c.safety_margin);
      EXPECT_GE(e.sight_half[a] + 1e-9, Extent(body, a, tau) + c.sight_margin + seen);
    }
    const double reach = 1.001 * solid + body.sigmas * most + 1e-6;
    EXPECT_LE(e.safety_half[a], reach + c.hard_radius() + c.safety_margin);
    EXPECT_LE(e.sight_half[a], reach + c.sight_margin + problem.target_growth.sum());
  }
}

/// What sorts out candidates: about the solid, grown along its axes.
struct Sorting {
  Matrix3d shape;
  double now, mean;  ///< deviations, m

  Sorting(const PlannerConfig& c, const PlanRequest& request, const world::Obstacle& o) {
    const Matrix3d R = o.axes.toRotationMatrix();
    const bool box = o.solid == world::Obstacle::Solid::kBox;
    shape = o.shape;
    if (box) shape = R * o.half.cwiseAbs2().cwiseInverse().asDiagonal() * R.transpose();
    const world::Body body = Truth(o, request.t0, request.horizon, c.sigmas, world::kOverdue);
    const auto deviations = [&](double tau) {
      const Matrix3d S =
          body.covariance[0] + tau * body.covariance[1] + tau * tau * body.covariance[2];
      return c.sigmas * std::sqrt(S.diagonal().maxCoeff());
    };
    now = deviations(0.0);
    mean = 0.5 * (now + deviations(1.0));
  }
  Matrix3d Grown(double by) const { return by > 0.0 ? world::Inflated(shape, by) : shape; }
  Matrix3d OfSight(const PlannerConfig& c, const Problem& problem, double share) const {
    return Grown(share * (c.sight_margin + 0.5 * problem.target_growth.sum() + mean));
  }
};

/// Margins give way as far as they must and no farther, the hard radius where the start is within
/// it only, and it is said.
void ExpectRelaxed(const PlannerConfig& c, const Problem& problem, const Ellipsoid& e,
                   const world::Body& body, const Sorting& sorting, const std::string& notes) {
  constexpr double kNear = 2e-4;     // m: what is off has to be so by a little
  constexpr double kBetween = 0.02;  // m: nearer between the samples
  const auto at_start = [&](double radius) {
    return Gap({problem.start, math::Polynomial::Constant(1, radius)}, nullptr, body, 0.0);
  };
  const auto least_of_target = [&](double share) {
    return LeastGap(SeenBall(problem, share), nullptr, body, 0.0);
  };
  const auto then = [](bool given, bool follows) { return !given || follows; };
  const double most = c.hard_radius() + c.safety_margin;
  const bool inside = e.safety_from > 0.0, hidden = e.sight_from > 0.0;
  EXPECT_TRUE(then(at_start(c.hard_radius()) < -kTolerance, inside));
  EXPECT_TRUE(then(at_start(c.hard_radius()) > kNear, !inside));
  EXPECT_TRUE(then(inside, e.safety_radius == c.hard_radius()));
  EXPECT_TRUE(then(!inside, at_start(e.safety_radius) >= -kTolerance));
  EXPECT_TRUE(then(at_start(most) > kNear, e.safety_radius == most));
  EXPECT_TRUE(then(!hidden, least_of_target(e.sight_share) >= -kTolerance));
  EXPECT_TRUE(then(hidden, least_of_target(0.0) <= kBetween));
  constexpr double kQuarter = 0.25;
  const bool within = !inside && e.safety_radius < most;
  EXPECT_TRUE(then(within, at_start(e.safety_radius + kQuarter * c.safety_margin) <= kNear));
  const auto first_sight = [&](double share) {
    const world::Ball seen = SeenBall(problem, share);
    const double gap = Gap({problem.start, math::Polynomial::Constant(1, share * c.sight_margin)},
                           &seen, body, 0.0);
    const double outside = world::SegmentSquaredDistance(
        problem.start.row(0).transpose(), problem.target.row(0).transpose(),
        e.center.row(0).transpose(), sorting.OfSight(c, problem, share));
    return outside <= kClear ? std::min(0.0, gap) : gap;
  };
  const bool less = !hidden && e.sight_share < 1.0;
  const double more = e.sight_share + kQuarter;
  const bool target_needs = less && least_of_target(more) <= kBetween;
  const bool start_needs = less && first_sight(more) <= kNear;
  EXPECT_TRUE(then(less, target_needs || start_needs)) << e.sight_share;
  // A line of sight that no share frees costs none.
  EXPECT_TRUE(then(less && first_sight(e.sight_share) < -kTolerance, target_needs));
  EXPECT_TRUE(then(less && first_sight(e.sight_share) < -kTolerance, first_sight(0.0) <= kNear));
  const auto noted = [&](const std::string& before, const std::string& after = "") {
    const std::string clause = "; " + before + "obstacle " + std::to_string(e.id) + after + ";";
    EXPECT_EQ(notes.find(clause), notes.rfind(clause)) << "said twice";
    return notes.find(clause) != std::string::npos;
  };
  EXPECT_EQ(noted("starts inside "), inside);
  EXPECT_EQ(noted("starts within the margin of "), within);
  EXPECT_EQ(noted("", " holds the target, its shadow is ignored"), hidden);
  const std::string kept = ", " + std::to_string(static_cast<int>(100.0 * e.sight_share)) +
                           " % of the target's margin and uncertainty kept";
  const bool passes = noted("the target passes within the sight margin of ", kept);
  const bool starts = noted("sight starts within the margin of ", kept);
  EXPECT_EQ(passes + starts, less ? 1 : 0);
  EXPECT_TRUE(then(passes, target_needs) && then(starts, start_needs));
}

/// It never holds the start, unless the body does.
void ExpectSorted(const PlannerConfig& c, const Problem& problem, const Ellipsoid& e,
                  const Sorting& sorting) {
  EXPECT_TRUE(e.sight_from > 0.0 ||
              e.sight.isApprox(sorting.OfSight(c, problem, e.sight_share), 1e-9));
  if (e.safety_from > 0.0) return;
  const Vector3d offset = (problem.start.row(0) - e.center.row(0)).transpose();
  EXPECT_GT(offset.dot(e.safety * offset), 1.0);
  const bool whole = e.safety_radius == c.hard_radius() + c.safety_margin;
  const double grown = e.safety_radius + (whole ? sorting.mean : sorting.now);
  for (const double share : {1.0, 0.5, 0.0}) {
    const Matrix3d full = sorting.Grown(share * grown);
    if (e.safety.isApprox(full, 1e-9)) return;
    EXPECT_LE(offset.dot(full * offset), kClear + 1e-9) << "could be larger";
  }
}

TEST(Minkowski, ProblemsAskForWhatTheBodiesAre) {
  const PlannerConfig c;
  int inside = 0, within = 0, holds_target = 0;
  for (unsigned seed = 1; seed <= 300; ++seed) {
    PlanRequest request = RandomRequest(c, seed);
    // Forecasts may be of degree 8, which has no control points of degree 6.
    const Eigen::MatrixXd target = request.target.coefficients;
    request.target.coefficients = Eigen::MatrixXd::Zero(seed % 20 == 0 ? 9 : target.rows(), 3);
    request.target.coefficients.topRows(target.rows()) = target;
    std::string notes;
    const Problem problem = MakeProblem(c, request, &notes);
    for (const double tau : {0.0, 0.4, 1.0}) {
      const double more = math::Evaluate(problem.target_growth, tau) -
                          c.sigmas * TargetSigma(request, request.t0 + tau * request.horizon);
      EXPECT_TRUE(more >= -1e-12 && (tau == 0.4 || more < 1e-12));
    }
    for (size_t i = 0; i < problem.obstacles.size(); ++i) {
      const Ellipsoid& e = problem.obstacles[i];
      const world::Body body =
          Truth(request.obstacles[i], request.t0, request.horizon, c.sigmas, world::kOverdue);
      ExpectBoxes(c, problem, e, body);
      const Sorting sorting(c, request, request.obstacles[i]);
      ExpectRelaxed(c, problem, e, body, sorting, "; " + notes + ";");
      ExpectSorted(c, problem, e, sorting);
      inside += e.safety_from > 0.0;
      within += e.safety_from == 0.0 && e.safety_radius < c.hard_radius() + c.safety_margin;
      holds_target += e.sight_from > 0.0;
    }
  }
  std::printf("%d hold the start, %d its margin, %d the target\n", inside, within, holds_target);
  EXPECT_GT(inside, 10);
  EXPECT_GT(holds_target, 10);
}

}  // namespace
}  // namespace chase::planning
