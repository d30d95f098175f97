#include <gtest/gtest.h>

#include <cstdlib>
#include <map>
#include <set>

#include "services/planning/margins.h"
#include "services/planning/planner.h"
#include "services/planning/problem.h"
#include "services/planning/separations.h"
#include "test/unit/planning_instances.h"
#include "test/unit/separation_model.h"

// Whole plans, with margins, tube and uncertainty, against distances by nearest points: what a plan
// claims has to hold in the Minkowski sum itself.

namespace chase::planning {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using world::Random;

constexpr int kInstants = 50;
constexpr double kTolerance = 1e-6;  // m

/// Walls, pillars, lumps; every other one moves with an uncertainty that grows.
world::Obstacle RandomObstacle(Random* random, const PlanRequest& request, int id) {
  world::Obstacle o;
  o.id = id;
  o.moving = random->Uniform() < 0.4;
  o.solid = static_cast<world::Obstacle::Solid>(random->Next() % 3);
  o.half = world::RandomHalfSizes(random);
  if (o.solid == world::Obstacle::Solid::kCylinder) o.half.y() = o.half.x();
  o.axes = Eigen::Quaterniond(world::RandomRotation(random, random->Uniform() < 0.7));
  const Matrix3d R = o.axes.toRotationMatrix();
  const bool turned = o.solid != world::Obstacle::Solid::kCylinder;
  o.shape = o.half.cwiseAbs2().cwiseInverse().asDiagonal();
  if (turned) o.shape = (R * o.shape * R.transpose()).eval();
  o.shape = (0.5 * (o.shape + o.shape.transpose())).eval();
  const Vector3d middle = request.target.Position(random->Uniform(0.0, request.horizon));
  o.center.start = request.t0 - random->Uniform(0.0, 0.2);
  o.center.duration = request.horizon;
  o.center.coefficients = Eigen::MatrixXd::Zero(o.moving ? 2 : 1, 3);
  o.center.coefficients.row(0) = (middle + world::RandomVector(random, 4.0, 4.0, 0.5)).transpose();
  if (!o.moving) return o;
  o.center.coefficients.row(1) =
      request.horizon * world::RandomVector(random, 0.8, 0.8, 0.1).transpose();
  for (Matrix3d* S : {&o.position_covariance, &o.velocity_covariance}) {
    const Matrix3d axes = world::RandomRotation(random, true);
    const Vector3d deviation(random->Uniform(0.01, 0.1), random->Uniform(0.01, 0.1), 0.02);
    *S = axes * deviation.cwiseAbs2().asDiagonal() * axes.transpose();
    *S = (0.5 * (*S + S->transpose())).eval();
  }
  return o;
}

PlanRequest RandomRequest(const PlannerConfig& config, unsigned seed) {
  InstanceSpec spec;
  spec.horizon = 2.5;
  spec.n_obstacles = 0;
  PlanRequest request = InstanceGenerator(config, spec).Make(seed);
  const double age = Random(seed, 78).Uniform(0.0, 0.5);  // of the forecast, s
  request.target = request.target.Reparametrised(request.t0 - age, request.horizon + age);
  Random random(seed, 77);
  request.target_sigma = random.Uniform(0.0, 0.05);
  request.target_speed_sigma = random.Uniform(0.0, 0.1);
  request.target_manoeuvre = {random.Uniform(0.0, 0.5), random.Uniform(0.2, 2.0)};
  const int n = 2 + static_cast<int>(random.Next() % 9);
  for (int i = 0; i < n; ++i) request.obstacles.push_back(RandomObstacle(&random, request, i));
  return request;
}

/// The obstacle over [start, start + duration], written anew.
world::Body Truth(const world::Obstacle& o, double start, double duration, double sigmas) {
  world::Body body;
  body.kind = o.solid;
  body.half = o.half;
  body.shape = o.solid == world::Obstacle::Solid::kBox ? o.axes.toRotationMatrix()
                                                       : Matrix3d(o.shape.inverse());
  const Vector3d v = o.center.Velocity(start);
  body.center = Curve::Zero(2, 3);
  body.center.row(0) = o.center.Position(start).transpose();
  body.center.row(1) = duration * v.transpose();
  const double age = start - o.center.start;
  body.sigmas = o.moving ? sigmas : 0.0;
  body.covariance[0] = o.position_covariance + age * age * o.velocity_covariance;
  body.covariance[1] = 2.0 * age * duration * o.velocity_covariance;
  body.covariance[2] = duration * duration * o.velocity_covariance;
  return body;
}

/// Least gap over [from, 1] of the ball about `way`, or of its hull with one about the target.
double LeastGap(const world::Trajectory& way, double radius, double from, const world::Ball* target,
                const world::Obstacle& o, double sigmas) {
  world::SeparationPair pair;
  pair.drone = {way.coefficients, math::Polynomial::Constant(1, radius)};
  pair.sight = target != nullptr;
  pair.target = target ? *target : pair.drone;
  pair.body = Truth(o, way.start, way.duration, sigmas);
  double least = HUGE_VAL;
  for (int i = 0; i <= kInstants; ++i) {
    const double tau = from + (1.0 - from) * i / kInstants;
    least = std::min(least, world::GapAt(pair, tau));
  }
  return least;
}

/// Standard deviation of the target's place along an axis at t, m.
double TargetSigma(const PlanRequest& request, double t) {
  const double since = t - request.target.start;
  const double v = request.target_speed_sigma * since;
  return std::sqrt(request.target_sigma * request.target_sigma + v * v +
                   request.target_manoeuvre.Variance(since));
}

/// What a plan that is called certified promises, one sentence per broken promise.
std::vector<std::string> BrokenPromises(const PlannerConfig& c, const PlanRequest& request,
                                        const PlanResult& plan) {
  std::vector<std::string> broken;
  std::map<int, int> safety;
  const auto check = [&](const char* what, double gap, int id) {
    if (gap < -kTolerance) broken.push_back(std::string(what) + std::to_string(id));
  };
  for (const Proof& p : plan.proofs) {
    const world::Obstacle& o = request.obstacles[static_cast<size_t>(p.obstacle)];
    const world::Trajectory seen =
        request.target.Reparametrised(plan.trajectory.start, plan.trajectory.duration);
    const world::Ball target{seen.coefficients, p.target_radius};
    safety[p.obstacle] += !p.of_sight;
    check(p.of_sight ? "sight of " : "safety from ",
          LeastGap(plan.trajectory, p.radius, p.from, p.of_sight ? &target : nullptr, o, c.sigmas),
          p.obstacle);
    if (!p.of_sight && p.radius < c.hard_radius()) broken.push_back("less than the hard radius");
    if (p.from > 0.0 && plan.verdict != Verdict::kEscape && !p.of_sight)
      broken.push_back("late, and no escape");
    if (!p.of_sight && p.from == 0.0)
      check("clearance from ",
            LeastGap(plan.trajectory, c.hard_radius() + plan.certified_clearance, 0.0, nullptr, o,
                     c.sigmas),
            p.obstacle);
    if (!p.of_sight && plan.reason.empty() && p.radius < c.hard_radius() + c.safety_margin - 1e-12)
      broken.push_back("less than the margin, unsaid");
    // The target's own uncertainty, from the request.
    if (p.of_sight && plan.reason.empty())
      for (const double tau : {0.0, 0.5, 1.0}) {
        const double t = plan.trajectory.start + tau * plan.trajectory.duration;
        check("uncertainty in sight of ",
              math::Evaluate(p.target_radius, tau) - c.sight_margin -
                  c.sigmas * TargetSigma(request, t),
              p.obstacle);
      }
  }
  if (safety.size() != request.obstacles.size()) broken.push_back("an obstacle without a proof");
  if (plan.verdict == Verdict::kChase && plan.reason.empty()) {
    size_t sights = 0;
    for (const Proof& p : plan.proofs) sights += p.of_sight && p.from == 0.0;
    if (sights != request.obstacles.size()) broken.push_back("sight without a proof");
  }
  if (plan.verdict == Verdict::kChase && plan.trajectory.duration < request.horizon)
    broken.push_back("a chase over a part of the horizon");
  if (plan.verdict <= Verdict::kSafeOnly && plan.trajectory.duration > request.horizon + 1e-9)
    broken.push_back("beyond the horizon");
  if (plan.stop)
    for (const Proof& p : plan.stop_proofs) {
      const world::Obstacle& o = request.obstacles[static_cast<size_t>(p.obstacle)];
      check("stop from ", LeastGap(*plan.stop, c.hard_radius(), p.from, nullptr, o, c.sigmas),
            o.id);
      if (p.from > 0.0 && plan.verdict != Verdict::kEscape)
        broken.push_back("late stop, no escape");
    }
  else if (plan.verdict != Verdict::kBrake &&
           plan.trajectory.Velocity(plan.trajectory.end()).norm() > 1e-6)
    broken.push_back("no stop");
  return broken;
}

/// The request of a planner whose plan is flown, so much later.
void GoOn(double later, const PlanResult& plan, PlanRequest* request) {
  const world::Trajectory& flown = plan.trajectory;
  request->t0 += later;
  request->horizon -= later;
  request->start = flown.At(std::min(request->t0, flown.end()));
  request->yaw = YawAt(plan.yaw, std::min(1.0, later / flown.duration), flown.duration);
  request->running = flown;
}

TEST(Minkowski, CertifiedPlansKeepOffWhatTheySayTheyDo) {
  const char* count = std::getenv("CHASE_PLANS");
  const unsigned n = count ? static_cast<unsigned>(std::atoi(count)) : 200;
  const PlannerConfig config;
  const auto planner = MakePlanner("chase", config);
  int certified = 0, in_sight = 0, false_accepts = 0;
  std::map<Verdict, int> verdicts;
  for (unsigned seed = 1; seed <= n; ++seed) {
    PlanRequest request = RandomRequest(config, seed);
    // Each plan, and the one that follows it.
    for (const double later : {0.0, 0.3}) {
      if (later > 0.0) GoOn(later, planner->Plan(request), &request);
      const PlanResult plan = planner->Plan(request);
      ++verdicts[plan.verdict];
      if (plan.certified_clearance < 0.0) continue;
      ++certified;
      in_sight += plan.verdict == Verdict::kChase;
      const std::vector<std::string> broken = BrokenPromises(config, request, plan);
      false_accepts += !broken.empty();
      for (const std::string& what : broken)
        ADD_FAILURE() << "seed " << seed << " " << later << " " << Name(plan.verdict) << ": "
                      << what;
    }
  }
  for (const auto& [verdict, k] : verdicts) std::printf("%s %d\n", Name(verdict), k);
  std::printf("%u plans, %d certified, %d false\n", 2 * n, certified, false_accepts);
  EXPECT_GT(certified, static_cast<int>(n));
  EXPECT_GT(in_sight, static_cast<int>(n) / 5);
}

void ExpectSameProofs(const std::vector<Proof>& a, const std::vector<Proof>& b) {
  ASSERT_EQ(a.size(), b.size());
  for (size_t i = 0; i < a.size(); ++i) {
    EXPECT_TRUE(a[i].obstacle == b[i].obstacle && a[i].of_sight == b[i].of_sight);
    EXPECT_TRUE(a[i].from == b[i].from && a[i].radius == b[i].radius && a[i].room == b[i].room);
    EXPECT_EQ(a[i].target_radius, b[i].target_radius);
    ASSERT_EQ(a[i].separations.size(), b[i].separations.size());
    for (size_t k = 0; k < a[i].separations.size(); ++k) {
      const world::Separation &s = a[i].separations[k], &r = b[i].separations[k];
      EXPECT_TRUE(s.from == r.from && s.to == r.to && s.normal == r.normal);
    }
  }
}

/// What was found out while the plan was tried, and while others were, makes the same proofs.
TEST(Minkowski, ProofsAreTheSameFromMemory) {
  const PlannerConfig c;
  const auto planner = MakePlanner("chase", c);
  int proven = 0, with_less = 0;
  for (unsigned seed = 1; seed <= 100; ++seed) {
    const PlanRequest request = RandomRequest(c, seed);
    const PlanResult plan = planner->Plan(request);
    if (plan.trajectory.duration != request.horizon) continue;
    const Problem problem = MakeProblem(c, request, nullptr);
    const Curve curve = plan.trajectory.coefficients;
    Curve other = curve;
    other.row(1).x() += 0.1;
    for (const double sight_from : {0.0, 1.0}) {
      const auto proofs = ProveOff(curve, problem, sight_from);
      SeparationMemory memory;
      StaysOff(other, problem, sight_from, nullptr, &memory);
      const bool off = StaysOff(curve, problem, sight_from, nullptr, &memory);
      const auto again = ProveOff(curve, problem, sight_from, &memory);
      ASSERT_EQ(again.has_value(), proofs.has_value()) << seed;
      EXPECT_EQ(off, proofs.has_value()) << seed;
      if (!proofs) continue;
      ExpectSameProofs(*again, *proofs);
      ++proven;
      for (const Ellipsoid& e : problem.obstacles) with_less += e.sight_share < 1.0;
    }
  }
  EXPECT_GT(proven, 50);
  EXPECT_GT(with_less, 20);
}

Curve RandomCurve(Random* random, const Vector3d& from, int rows, double spread) {
  Curve curve = Curve::Zero(rows, 3);
  curve.row(0) = from.transpose();
  for (int k = 1; k < rows; ++k)
    curve.row(k) = world::RandomVector(random, spread, spread, 0.3 * spread).transpose();
  return curve;
}

/// Least gap of what the problem asks of the plan about an obstacle.
double LeastAsked(const PlanRequest& request, const Problem& problem, const Curve& plan,
                  const Ellipsoid& e, const world::Obstacle& o, double sight_from) {
  const world::Trajectory way{request.t0, request.horizon, plan};
  double least = LeastGap(way, e.safety_radius, e.safety_from, nullptr, o, problem.sigmas);
  const double from = std::max(sight_from, e.sight_from);
  if (from >= 1.0) return least;
  math::Polynomial radius = e.sight_share * problem.target_growth;
  radius[0] += e.sight_share * problem.sight_radius;
  const world::Ball target{problem.target, radius};
  return std::min(
      least, LeastGap(way, e.sight_share * problem.sight_radius, from, &target, o, problem.sigmas));
}

/// Of any degree, from any time on, of all obstacles or of those that are near: what is called off
/// is, and what is off by a little is called so. No proof claims more room than there is.
TEST(Minkowski, PlansStayOffWhereSamplesSaySo) {
  PlannerConfig c;
  constexpr double kBetween = 0.03;  // m: nearer between the samples
  int off = 0, on = 0, refused = 0, high = 0;
  for (unsigned seed = 1; seed <= 200; ++seed) {
    c.safety_margin = seed % 2 ? 0.03 : 0.6;  // beyond what is kept of the line of sight
    Random random(seed, 81);
    PlanRequest request = RandomRequest(c, seed);
    request.obstacles.resize(std::min<size_t>(request.obstacles.size(), 1 + seed % 3));
    const auto rows = [&](int most) { return 1 + static_cast<int>(random.Next() % 9) % most; };
    const int n = random.Next() % 4 ? rows(7) : 9;
    request.target.coefficients = RandomCurve(&random, request.target.Position(request.t0),
                                              random.Next() % 4 ? rows(7) : 9, 1.0);
    request.target.start = request.t0;
    request.target.duration = request.horizon;
    const Curve plan = RandomCurve(&random, request.start.p, n, 2.0);
    request.start.v =
        plan.rows() > 1 ? Vector3d(plan.row(1).transpose() / request.horizon) : Vector3d::Zero();
    if (seed % 5 == 0) {
      request.target_body = request.obstacles.back();
      request.target_body->id = kTargetId;
    }
    Problem problem = MakeProblem(c, request, nullptr);
    const double sight_from = 0.25 * static_cast<double>(random.Next() % 5);
    double least = HUGE_VAL;
    for (size_t i = 0; i < problem.obstacles.size(); ++i)
      if (problem.obstacles[i].safety_from > 0.0)
        least = std::min(least, -1.0);  // leaves it as well: another test
      else
        least = std::min(least, LeastAsked(request, problem, plan, problem.obstacles[i],
                                           request.obstacles[i], sight_from));
    if (least == -1.0) continue;
    if (problem.target_body) {
      if (problem.target_body->safety_from > 0.0) continue;
      least = std::min(least, LeastAsked(request, problem, plan, *problem.target_body,
                                         *request.target_body, 1.0));
    }
    int first = static_cast<int>(random.Next() % 3) - 1;
    const int before = first;
    const bool stays = StaysOff(plan, problem, sight_from, seed % 2 ? &first : nullptr);
    const auto proofs = ProveOff(plan, problem, sight_from);
    EXPECT_EQ(proofs.has_value(), stays) << seed;
    EXPECT_FALSE(stays && least < -kTolerance) << seed << " " << least;
    refused += !stays && least > kBetween;
    EXPECT_TRUE(!stays || first == before);
    if (!stays && seed % 2 && first != before) {
      const size_t bad = static_cast<size_t>(first);
      EXPECT_LT(LeastAsked(request, problem, plan, problem.obstacles[bad], request.obstacles[bad],
                           sight_from),
                kBetween)
          << seed;
    }
    ++(stays ? off : on);
    high += stays && (n > 7 || problem.target.rows() > 7);
    if (!proofs) continue;
    size_t asked = 0;
    for (const Ellipsoid& e : problem.obstacles)
      asked += std::max(sight_from, e.sight_from) < 1.0 ? 2 : 1;
    EXPECT_EQ(proofs->size(), asked + problem.target_body.has_value());
    const world::Trajectory way{request.t0, request.horizon, plan};
    for (const Proof& p : *proofs) {
      const world::Obstacle& o = p.obstacle == kTargetId
                                     ? *request.target_body
                                     : request.obstacles[static_cast<size_t>(p.obstacle)];
      if (p.of_sight) continue;
      EXPECT_GE(p.radius, c.hard_radius());
      EXPECT_GE(LeastGap(way, p.radius + p.room, p.from, nullptr, o, c.sigmas), -kTolerance)
          << seed;
      EXPECT_GE(p.room, 0.0);
    }
    // Those that are far need not be asked about.
    problem.reach = Box{Eigen::Array3d::Constant(-1e3), Eigen::Array3d::Constant(1e3)};
    problem.near.clear();
    if (n <= 7) {
      EXPECT_TRUE(StaysOff(plan, problem, sight_from));
      for (size_t i = 0; i < problem.obstacles.size(); ++i)
        problem.near.push_back(static_cast<int>(i));
      EXPECT_EQ(StaysOff(plan, problem, sight_from), stays);
    }
  }
  std::printf("%d stay off, %d do not, %d for want of a proof; %d of a high degree\n", off, on,
              refused, high);
  EXPECT_GT(off, 50);
  EXPECT_GT(on, 15);
  EXPECT_GT(high, 10);
  EXPECT_LE(refused, off / 20);
}

/// What the highest power alone leads a plan into, or a target behind, is near.
TEST(Minkowski, HighPowersAreNotLeftOut) {
  const PlannerConfig c;
  PlanRequest request;
  request.start.p = {0.0, 0.0, 1.5};
  request.target = world::Trajectory::Constant({0.0, 2.5, 1.5}, 0.0, request.horizon);
  world::Obstacle pillar;
  pillar.solid = world::Obstacle::Solid::kCylinder;
  pillar.half = {0.3, 0.3, 2.0};
  pillar.shape = (2.0 * pillar.half.cwiseAbs2()).cwiseInverse().asDiagonal();
  pillar.center = world::Trajectory::Constant({5.0, 1.25, 1.0}, 0.0, 1.0);
  request.obstacles = {pillar};
  Curve still = Curve::Zero(9, 3), away = Curve::Zero(9, 3);
  still.row(0) = request.start.p.transpose();
  away.row(0) = request.start.p.transpose();
  away.row(8) << 5.0, 1.25, 0.0;
  EXPECT_TRUE(StaysOff(still, MakeProblem(c, request, nullptr), 0.0));
  EXPECT_FALSE(StaysOff(away, MakeProblem(c, request, nullptr), 1.0));
  request.target.coefficients = Eigen::MatrixXd::Zero(9, 3);
  request.target.coefficients.row(0) << 0.0, 2.5, 1.5;
  request.target.coefficients.row(8) << 10.0, 0.0, 0.0;
  EXPECT_FALSE(StaysOff(still, MakeProblem(c, request, nullptr), 0.0));
}

/// Gap of the way's ball, or of its hull with the target's, at tau.
double Gap(const world::Ball& drone, const world::Ball* target, const world::Body& body,
           double tau) {
  world::SeparationPair pair;
  pair.drone = drone;
  pair.sight = target != nullptr;
  pair.target = target ? *target : drone;
  pair.body = body;
  return world::GapAt(pair, tau);
}

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

/// Clauses of the notes.
std::set<std::string> Clauses(const std::string& notes) {
  std::set<std::string> clauses;
  for (size_t at = 0; at < notes.size();) {
    const size_t end = std::min(notes.find("; ", at), notes.size());
    EXPECT_TRUE(clauses.insert(notes.substr(at, end - at)).second) << notes;
    at = end + 2;
  }
  return clauses;
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
    const auto deviations = [&](double t) {
      const double age = t - o.center.start;
      const Matrix3d S = o.position_covariance + age * age * o.velocity_covariance;
      return c.sigmas * std::sqrt(S.diagonal().maxCoeff());
    };
    now = deviations(request.t0);
    mean = 0.5 * (now + deviations(request.t0 + request.horizon));
  }
  Matrix3d Grown(double by) const { return by > 0.0 ? world::Inflated(shape, by) : shape; }
  Matrix3d OfSight(const PlannerConfig& c, const Problem& problem, double share) const {
    return Grown(share * (c.sight_margin + 0.5 * problem.target_growth.sum() + mean));
  }
};

/// Margins give way as far as they must and no farther, the hard radius where the start is within
/// it only, and it is said.
void ExpectRelaxed(const PlannerConfig& c, const Problem& problem, const Ellipsoid& e,
                   const world::Body& body, const Sorting& sorting,
                   const std::set<std::string>& notes) {
  constexpr double kNear = 2e-4;     // m: what is off has to be so by a little
  constexpr double kBetween = 0.02;  // m: nearer between the samples
  const auto at_start = [&](double radius) {
    return Gap({problem.start, math::Polynomial::Constant(1, radius)}, nullptr, body, 0.0);
  };
  const auto target = [&](double share) {
    math::Polynomial radius = share * problem.target_growth;
    radius[0] += share * c.sight_margin;
    return world::Ball{problem.target, radius};
  };
  const auto least_of_target = [&](double share) {
    double least = HUGE_VAL;
    for (int i = 0; i <= kInstants; ++i)
      least = std::min(least, Gap(target(share), nullptr, body, 1.0 * i / kInstants));
    return least;
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
    const world::Ball seen = target(share);
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
    return notes.count(before + "obstacle " + std::to_string(e.id) + after) > 0;
  };
  EXPECT_EQ(noted("starts inside "), inside);
  EXPECT_EQ(noted("starts within the margin of "), within);
  EXPECT_EQ(noted("", " holds the target, its shadow is ignored"), hidden);
  const bool passes = noted("the target passes within the sight margin of ");
  const bool starts = noted("sight starts within the margin of ");
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
    const std::set<std::string> clauses = Clauses(notes);
    for (const double tau : {0.0, 0.4, 1.0}) {
      const double deviations = c.sigmas * TargetSigma(request, request.t0 + tau * request.horizon);
      EXPECT_GE(math::Evaluate(problem.target_growth, tau), deviations - 1e-12);
      EXPECT_TRUE(tau == 0.4 ||
                  std::abs(math::Evaluate(problem.target_growth, tau) - deviations) < 1e-12);
    }
    for (size_t i = 0; i < problem.obstacles.size(); ++i) {
      const Ellipsoid& e = problem.obstacles[i];
      const world::Body body = Truth(request.obstacles[i], request.t0, request.horizon, c.sigmas);
      ExpectBoxes(c, problem, e, body);
      const Sorting sorting(c, request, request.obstacles[i]);
      ExpectRelaxed(c, problem, e, body, sorting, clauses);
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
