// The rungs of the ladder one by one: a search that finds nothing before the nth question sees what
// is asked for, and in what order; the plan then says no more than that.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "services/planning/cost.h"
#include "services/planning/ladder.h"
#include "services/planning/search.h"

namespace chase::planning {
namespace {

using Eigen::Vector3d;

constexpr int kIndex = 3;
constexpr int kGenerated = 11, kChecked = 5, kFeasible = 2;  // that each question is said to take

struct Question {
  Problem problem;
  double sight_from, bound;

  bool in_sight() const { return sight_from == 0.0; }
  size_t width() const { return problem.skeletons.front().size(); }
};

/// Goes straight on, once that has been asked for more than `before` times.
class Scripted : public Search {
 public:
  Scripted(size_t before, std::vector<Question>* asked) : before_(before), asked_(asked) {}
  Found Best(const Problem& problem, double sight_from, double bound, PlanProof*) override {
    asked_->push_back({problem, sight_from, bound});
    Found found;
    found.generated = kGenerated;
    found.checked = kChecked;
    found.feasible = kFeasible;
    if (asked_->size() <= before_) return found;
    found.index = kIndex;
    found.plan = problem.start;
    found.cost.total = 7.0;
    return found;
  }

 private:
  size_t before_;
  std::vector<Question>* asked_;
};

PlannerConfig Config() {
  PlannerConfig c;
  c.refine = false;
  return c;
}

/// Behind a target that walks on as the drone flies, a pillar beside the way.
PlanRequest Walk() {
  PlanRequest r;
  r.t0 = 4.0;
  r.start.p = {-2.5, 0.0, 1.3};
  r.start.v = {0.6, 0.0, 0.0};
  r.yaw = YawStart{0.0, 0.0};
  r.target = {r.t0, r.horizon, Eigen::MatrixXd::Zero(2, 3)};
  r.target.coefficients << 0.0, 0.0, 0.85, 0.6 * r.horizon, 0.0, 0.0;
  world::Obstacle pillar;
  pillar.id = 5;
  pillar.solid = world::Obstacle::Solid::kCylinder;
  pillar.half = {0.3, 0.3, 2.0};
  pillar.shape = (2.0 * pillar.half.cwiseAbs2()).cwiseInverse().asDiagonal();
  pillar.center = world::Trajectory::Constant({0.0, 2.0, 1.0}, r.t0, 1.0);
  r.obstacles = {pillar};
  return r;
}

world::Obstacle TargetBody(const PlanRequest& r) {
  world::Obstacle o = r.obstacles.front();
  o.id = kTargetId;
  o.moving = true;
  o.half = {0.3, 0.3, 0.85};
  o.center = r.target;
  return o;
}

struct Answer {
  PlanResult plan;
  std::vector<Question> asked;
};

Answer Ask(const PlannerConfig& c, const PlanRequest& r, size_t before) {
  Answer a;
  a.plan = MakeLadder(c, std::make_unique<Scripted>(before, &a.asked))->Plan(r);
  return a;
}

double Margin(const PlannerConfig& c, const Question& q) {
  return q.problem.obstacles.front().safety_radius - c.hard_radius();
}

/// Percents that follow the words in the reason; -1: none.
int Percent(const std::string& reason, const std::string& words) {
  const size_t at = reason.find(words);
  return at == std::string::npos ? -1 : std::atoi(reason.c_str() + at + words.size());
}

bool Says(const PlanResult& plan, const std::string& words) {
  return plan.reason.find(words) != std::string::npos;
}

// Sight over all of the plan is asked for as long as there is any way to: first with everything,
// then over less and less time, with half of the margins last. Then sight from later and later on,
// in the image for as long as that is asked, at last none.
TEST(Rungs, EachAsksForLessThanTheOnesBefore) {
  const PlannerConfig c = Config();
  for (const bool body : {false, true}) {
    PlanRequest request = Walk();
    if (body) request.target_body = TargetBody(request);
    const auto asked = Ask(c, request, 1000).asked;
    const auto later =
        std::find_if(asked.begin(), asked.end(), [](const Question& q) { return !q.in_sight(); });
    ASSERT_GT(later - asked.begin(), 4);
    ASSERT_GT(asked.end() - later, 3);
    const Question& first = asked.front();
    std::set<std::vector<double>> seen;
    bool halved = false;
    for (auto q = asked.begin(); q != later; ++q) {
      const double share = q->problem.duration / request.horizon;
      const bool half = q->problem.sight_radius < c.sight_margin;
      EXPECT_NEAR(Margin(c, *q), (half ? 0.5 : 1.0) * c.safety_margin, 1e-12);
      EXPECT_NEAR(q->problem.sight_radius, (half ? 0.5 : 1.0) * c.sight_margin, 1e-12);
      EXPECT_FALSE(halved && !half) << "half of the margins are the last to be offered";
      halved = half;
      EXPECT_TRUE(share > 1.0 / 3.0 && share <= 1.0) << share;
      EXPECT_TRUE(share < 1.0 || q->problem.limits.z_min == first.problem.limits.z_min);
      EXPECT_GE(q->width(), first.width());
      EXPECT_TRUE(q->problem.limits.view && q->problem.limits.view_from == 0.0);
      EXPECT_GT(q->problem.limits.tan_elevation * q->problem.limits.min_distance, 0.0);
      if (q == asked.begin()) continue;
      const auto& before = *(q - 1);
      const bool same =
          q->width() == before.width() && half == (before.problem.sight_radius < c.sight_margin);
      EXPECT_EQ(share < 1.0, same) << "each kind begins with the whole horizon";
      EXPECT_TRUE(!same || q->problem.duration < before.problem.duration);
    }
    EXPECT_TRUE(halved);
    EXPECT_EQ(first.problem.duration, request.horizon);
    EXPECT_TRUE(std::any_of(asked.begin(), later, [&](const Question& q) {
      return q.width() > first.width() && q.problem.duration == request.horizon;
    })) << "wide skeletons";
    for (auto q = later; q != asked.end(); ++q) {
      const Limits& l = q->problem.limits;
      EXPECT_EQ(q->problem.duration, request.horizon);
      EXPECT_NEAR(Margin(c, *q), c.safety_margin, 1e-12);
      EXPECT_EQ(4.0 * q->sight_from, std::floor(4.0 * q->sight_from)) << "as the search wants it";
      EXPECT_EQ(l.tan_elevation, 0.0);
      EXPECT_EQ(l.min_distance, body ? 0.0 : c.min_distance) << "while nothing else keeps it off";
      EXPECT_EQ(l.view_from, q->sight_from);
      EXPECT_TRUE(seen.insert({q->sight_from, l.view ? 1.0 : 0.0}).second);
      if (q == later) continue;
      const bool viewed = (q - 1)->problem.limits.view.has_value();
      EXPECT_LE(l.view.has_value(), viewed);
      EXPECT_TRUE(viewed != l.view.has_value() || q->sight_from > (q - 1)->sight_from);
      if (q->sight_from < 1.0) {
        EXPECT_TRUE(seen.count({q->sight_from, 1.0})) << "in the image first";
      }
    }
    EXPECT_TRUE(later->problem.limits.view && later->sight_from == 0.25);
    EXPECT_TRUE(!asked.back().problem.limits.view && asked.back().sight_from == 1.0);
  }
}

// Where somebody comes to where braking leads, half of the horizon is asked for before it gets out
// of the way.
TEST(Rungs, HalfOfTheHorizonComesBeforeEscapes) {
  const PlannerConfig c = Config();
  PlanRequest request = Walk();
  const size_t n = Ask(c, request, 1000).asked.size();
  world::Obstacle walker = request.obstacles.front();
  walker.id = 6;
  walker.moving = true;
  walker.center = {request.t0, 5.0, Eigen::MatrixXd::Zero(2, 3)};
  walker.center.coefficients << -2.3, 3.2, 1.0, 0.0, -5.0 * 1.6, 0.0;
  request.obstacles.push_back(walker);
  EXPECT_EQ(Ask(c, request, 1000).plan.verdict, Verdict::kEscape);
  const auto [plan, asked] = Ask(c, request, n);
  ASSERT_EQ(asked.size(), n + 1);
  EXPECT_EQ(asked.back().problem.duration, 0.5 * request.horizon);
  EXPECT_EQ(asked.back().sight_from, 0.25);
  EXPECT_EQ(plan.verdict, Verdict::kSafeOnly);
  EXPECT_TRUE(Says(plan, "over half of the horizon")) << plan.reason;
  EXPECT_EQ(plan.trajectory.duration, 0.5 * request.horizon);
  EXPECT_TRUE(plan.stop);
}

TEST(Rungs, ThePlanSaysWhatItWasAskedForAndKeepsThat) {
  const PlannerConfig c = Config();
  const PlanRequest request = Walk();
  const size_t n = Ask(c, request, 1000).asked.size();
  for (size_t i = 0; i < n; ++i) {
    const auto [plan, asked] = Ask(c, request, i);
    ASSERT_EQ(asked.size(), i + 1) << "what is found is taken";
    const Question& q = asked.back();
    const bool half = q.problem.sight_radius < c.sight_margin;
    const double share = q.problem.duration / request.horizon;
    EXPECT_EQ(plan.verdict, i == 0         ? Verdict::kChase
                            : q.in_sight() ? Verdict::kWider
                                           : Verdict::kSafeOnly)
        << plan.reason;
    EXPECT_EQ(plan.reason.empty(), i == 0) << plan.reason;
    EXPECT_EQ(Says(plan, "with half of the margins"), half);
    EXPECT_EQ(Percent(plan.reason, "sight over "),
              q.in_sight() && share < 1.0 ? static_cast<int>(100.0 * share + 1e-9) : -1);
    EXPECT_EQ(Says(plan, "normal skeletons"), q.in_sight() && q.width() > asked[0].width());
    EXPECT_EQ(Percent(plan.reason, "has it from "),
              !q.in_sight() && q.sight_from < 1.0 ? static_cast<int>(100.0 * q.sight_from) : -1);
    EXPECT_EQ(Says(plan, "keeps or regains"), q.sight_from == 1.0);
    EXPECT_EQ(plan.trajectory.start, request.t0);
    EXPECT_EQ(plan.trajectory.duration, q.problem.duration);
    EXPECT_EQ(Curve(plan.trajectory.coefficients), q.problem.start);
    EXPECT_EQ(plan.winner, kIndex);
    EXPECT_EQ(plan.cost.total, 7.0);
    const int times = static_cast<int>(i) + 1;
    EXPECT_EQ(plan.generated, times * kGenerated);
    EXPECT_EQ(plan.checked, times * kChecked);
    EXPECT_EQ(plan.feasible, times * kFeasible);
    EXPECT_TRUE(plan.in_field);
    EXPECT_TRUE(plan.stop && !plan.stop_proofs.empty());
    EXPECT_GE(plan.certified_clearance, Margin(c, q) - 1e-9);
    EXPECT_LE(plan.certified_clearance, request.start.p.z() - c.hard_radius()) << "the ground";
    ASSERT_EQ(plan.proofs.size(), q.sight_from < 1.0 ? 2u : 1u) << i;
    for (const Proof& p : plan.proofs)
      EXPECT_EQ(p.from, p.of_sight ? q.sight_from : 0.0) << plan.reason;
  }
}

// What is said of margins is said of those that were asked for.
TEST(Rungs, WhatGivesWayIsSaidWhereItDoes) {
  PlannerConfig c = Config();
  c.safety_margin = 0.1;
  PlanRequest request = Walk();
  const double off = c.hard_radius() + 0.6 * c.safety_margin;
  world::Obstacle& pillar = request.obstacles.front();
  pillar.center = world::Trajectory::Constant({-2.5, pillar.half.x() + off, 1.0}, request.t0, 1.0);
  const size_t n = Ask(c, request, 1000).asked.size();
  int said = 0, not_said = 0;
  for (size_t i = 0; i < n; ++i) {
    const auto [plan, asked] = Ask(c, request, i);
    const bool half = asked.back().problem.sight_radius < c.sight_margin;
    EXPECT_NEAR(Margin(c, asked.back()), 0.5 * c.safety_margin, 1e-12);
    EXPECT_EQ(Says(plan, "starts within the margin of obstacle 5"), !half) << plan.reason;
    EXPECT_LT(plan.certified_clearance, 0.7 * c.safety_margin);
    ++(half ? not_said : said);
  }
  EXPECT_TRUE(said > 3 && not_said > 0);
}

// Where nothing is found it brakes, and says how much was looked at.
TEST(Rungs, TheLastOneIsToBrake) {
  const PlannerConfig c = Config();
  const PlanRequest request = Walk();
  const auto [plan, asked] = Ask(c, request, 1000);
  EXPECT_EQ(plan.verdict, Verdict::kBrake);
  EXPECT_EQ(plan.reason, "no candidate is safe");
  EXPECT_TRUE(world::EndsAtRest(plan.trajectory));
  EXPECT_GE(plan.certified_clearance, 0.0);
  const int n = static_cast<int>(asked.size());
  EXPECT_EQ(plan.generated, n * kGenerated);
  EXPECT_EQ(plan.checked, n * kChecked);
  EXPECT_EQ(plan.feasible, n * kFeasible);
  PlanRequest rest = request;
  rest.horizon = plan.trajectory.duration;
  const double cost =
      Evaluate(c, MakeProblem(c, rest, nullptr), plan.trajectory.coefficients).total;
  EXPECT_NEAR(plan.cost.total, cost, 1e-9 * cost);
}

/// The request `later` s on, along a plan that goes straight on for `duration` s.
PlanRequest AlongRunning(double duration, double later) {
  PlanRequest request = Walk();
  world::Trajectory running{request.t0, duration, Eigen::MatrixXd::Zero(4, 3)};
  running.coefficients.row(0) = request.start.p.transpose();
  running.coefficients.row(1) = duration * request.start.v.transpose();
  request.t0 += later;
  request.start = running.At(request.t0);
  request.running = running;
  return request;
}

/// Hovering, with `rest` s left of that, while the target walks behind a wall soon after.
PlanRequest BeforeACorner(double rest) {
  PlanRequest request = Walk();
  request.start.v.setZero();
  request.running = world::Trajectory::Constant(request.start.p, request.t0 + rest - 2.5, 2.5);
  request.target.coefficients << 0.0, 0.0, 0.85, 0.0, request.horizon, 0.0;
  world::Obstacle& wall = request.obstacles.front();
  wall.solid = world::Obstacle::Solid::kBox;
  wall.half = {0.1, 10.0, 10.0};
  wall.shape = (3.0 * wall.half.cwiseAbs2()).cwiseInverse().asDiagonal();
  const double in_sight = 0.76 * rest + 0.35;  // 1.9 m of the 2.5 m to the target
  wall.center = world::Trajectory::Constant({-0.6, in_sight + 10.0, 1.0}, request.t0, 1.0);
  return request;
}

// What the running plan has left comes before what the search finds over less; nearly over it is
// not worth that any more.
TEST(Rungs, TheRestOfTheRunningPlanComesBeforeShorterOnes) {
  PlannerConfig c;
  c.max_speed = 0.1;  // no way around the corner
  for (const double rest : {2.0, 1.5, 1.0, 0.4, 0.33, 0.27}) {
    PlanRequest request = BeforeACorner(rest);
    const auto [plan, asked] = Ask(c, request, 1000);
    EXPECT_EQ(plan.verdict, rest > 0.3 ? Verdict::kKept : Verdict::kBrake) << plan.reason;
    if (plan.verdict != Verdict::kKept) continue;
    EXPECT_GE(plan.certified_clearance, 0.0);
    EXPECT_EQ(plan.trajectory.start, request.t0);
    EXPECT_NEAR(plan.trajectory.end(), request.running->end(), 1e-9) << rest;
    EXPECT_EQ(plan.winner, -1);
    for (const Question& q : asked) EXPECT_TRUE(q.in_sight());
    for (const Question& q : asked) EXPECT_TRUE(rest < 0.9 || q.problem.duration >= rest) << rest;
    EXPECT_EQ(Says(plan, "the rest of the running plan is"), rest > 0.9) << plan.reason;
    EXPECT_EQ(Says(plan, "the running plan still is, with half of the margins"), rest < 0.9)
        << plan.reason;
    EXPECT_FALSE(Says(plan, "led around"));
    for (const Proof& p : plan.proofs) EXPECT_EQ(p.from, 0.0);
    request.horizon = rest;
    const double cost =
        Evaluate(c, MakeProblem(c, request, nullptr), plan.trajectory.coefficients).total;
    EXPECT_NEAR(plan.cost.total, cost, 1e-9 * cost);
  }
}

/// A ball so far beside the way.
PlanRequest Beside(double room) {
  PlanRequest request = AlongRunning(2.5, 0.0);
  world::Obstacle& ball = request.obstacles.front();
  ball.solid = world::Obstacle::Solid::kEllipsoid;
  ball.shape = Eigen::Matrix3d::Identity() / (0.3 * 0.3);
  ball.center = world::Trajectory::Constant({-1.5, 0.3 + room, 1.3}, request.t0, 1.0);
  return request;
}

// A running plan is kept while half of the margins are left, for as long as it goes on.
TEST(Rungs, ARunningPlanStandsWithHalfOfTheMargins) {
  PlannerConfig c;
  c.sight_margin = 0.0;
  c.safety_margin = 0.2;
  const auto planner = MakePlanner("chase", c);
  const auto stands = [&](double room) {
    const PlanRequest request = Beside(room);
    return planner->IsCertified(request, *request.running);
  };
  EXPECT_TRUE(stands(c.hard_radius() + 0.5 * c.safety_margin + 2e-3));
  EXPECT_FALSE(stands(c.hard_radius() + 0.5 * c.safety_margin - 2e-3));
  PlanRequest request = Beside(5.0);
  EXPECT_TRUE(planner->IsCertified(request, *request.running));
  request.t0 = request.running->end() - 0.04;
  EXPECT_FALSE(planner->IsCertified(request, *request.running)) << "nearly over";
  request.t0 = request.running->end() - 0.06;
  EXPECT_TRUE(planner->IsCertified(request, *request.running));
  request.t0 = request.running->end() + 1.0;
  EXPECT_FALSE(planner->IsCertified(request, *request.running));
}

// Ellipsoids without bodies are not proved again; whatever has a body is.
TEST(Rungs, OnlyWhatHasABodyIsProved) {
  PlannerConfig c = Config();
  c.minkowski_sums = false;
  PlanRequest request = Walk();
  const PlanResult plan = Ask(c, request, 0).plan;
  EXPECT_EQ(plan.verdict, Verdict::kChase) << plan.reason;
  EXPECT_TRUE(plan.proofs.empty() && !plan.stop);
  EXPECT_LT(plan.certified_clearance, 0.0);
  request.target_body = TargetBody(request);
  EXPECT_EQ(Ask(c, request, 0).plan.proofs.size(), 1u);
  request.obstacles.clear();
  request.target_body.reset();
  EXPECT_TRUE(Ask(c, request, 0).plan.stop) << "of nothing there is a proof";
}

// Within the target's body it says so, as within any other.
TEST(Rungs, AStartAtTheTargetIsAnEscape) {
  PlanRequest request = Walk();
  request.start.v.setZero();
  request.target.coefficients << -1.95, 0.0, 0.85, 1.5, 0.0, 0.0;
  request.target_body = TargetBody(request);
  const PlanResult plan = MakePlanner("chase", PlannerConfig())->Plan(request);
  EXPECT_TRUE(Says(plan, "starts at the target")) << plan.reason;
  EXPECT_EQ(plan.verdict, Verdict::kEscape) << plan.reason;
}

}  // namespace
}  // namespace chase::planning
