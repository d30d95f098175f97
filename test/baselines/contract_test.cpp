// The contract of every planner of the comparison: starts at the given state, keeps limits, repeats
// bit for bit, never throws, honest verdicts.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "common/world/random.h"
#include "test/baselines/pieces.h"
#include "test/baselines/registry.h"
#include "test/compare/mission.h"

namespace chase::baselines {
namespace {

using Eigen::Vector3d;
using planning::PlanRequest;
using planning::PlanResult;
using planning::Verdict;

/// Every planner, and two parameter sets of those that have some. Not `chase_paper`, which is
/// `chase` with other candidates: of one request it makes WIDER with half of the sight margin, as
/// its reason says, and that is less than the drone's radius that sight is judged by here.
std::vector<std::string> Names() {
  std::vector<std::string> names;
  for (const Entry& e : Planners()) {
    if (e.name == "chase_paper") continue;
    names.push_back(e.name);
    if (e.n_sets > 0) names.push_back(e.name + ":" + std::to_string(e.n_sets));
  }
  return names;
}

const compare::Mission& MissionOf(const std::string& name) {
  static std::map<std::string, compare::Mission> missions;
  auto at = missions.find(name);
  if (at == missions.end()) at = missions.emplace(name, compare::LoadMission(name)).first;
  return at->second;
}

/// A request in the middle of a scenario: the drone beside its ring, with a state of its own.
PlanRequest RequestAt(const compare::Mission& mission, double t, uint64_t seed) {
  world::Random random(seed);
  const auto some = [&](double size) {
    return Vector3d(random.Uniform(-size, size), random.Uniform(-size, size),
                    random.Uniform(-0.3 * size, 0.3 * size));
  };
  PlanRequest request;
  request.t0 = t;
  request.horizon = mission.planning.horizon;
  request.target = compare::FitTarget(mission, t, request.horizon);
  request.obstacles = mission.obstacles;
  const Vector3d q = mission.Target(t), v = mission.TargetVelocity(t);
  request.start.p = q - mission.desired_distance * v.normalized() + some(0.4) + Vector3d(0, 0, 0.3);
  request.start.v = v + some(0.3);
  request.start.a = some(0.3);
  request.start.j = some(0.2);
  return request;
}

std::vector<PlanRequest> Requests() {
  std::vector<PlanRequest> requests;
  for (const char* name : {"S1", "S6", "S12"})
    for (double t : {2.0, 17.0, 33.5})
      requests.push_back(RequestAt(MissionOf(name), t, static_cast<uint64_t>(t) + requests.size()));
  return requests;
}

class Contract : public testing::TestWithParam<std::string> {
 protected:
  std::unique_ptr<planning::Planner> Make() const {
    return MakePlanner(GetParam(), {config(), "S6", 0});
  }
  static planning::PlannerConfig config() { return MissionOf("S6").planning.planner; }
  bool Is(const std::string& name) const { return GetParam().rfind(name, 0) == 0; }
  /// Rivals that steer acceleration or jerk do not continue what they steer.
  int orders() const { return Is("naegeli") ? 2 : Is("hierarchical") || Is("follow") ? 3 : 4; }
};

void ExpectSameBits(const PlanResult& a, const PlanResult& b) {
  EXPECT_EQ(a.verdict, b.verdict);
  EXPECT_EQ(a.reason, b.reason);
  const Pieces x = PiecesOf(a), y = PiecesOf(b);
  ASSERT_EQ(x.size(), y.size());
  for (size_t i = 0; i < x.size(); ++i) {
    EXPECT_EQ(x[i].start, y[i].start);
    EXPECT_EQ(x[i].duration, y[i].duration);
    EXPECT_EQ(x[i].coefficients, y[i].coefficients);
  }
}

TEST_P(Contract, StartsAtTheGivenStateAndIsContinuous) {
  const auto planner = Make();
  for (const PlanRequest& request : Requests()) {
    const PlanResult result = planner->Plan(request);
    const Pieces plan = PiecesOf(result);
    const world::State s = StateAt(plan, request.t0), &want = request.start;
    const Vector3d got[] = {s.p, s.v, s.a, s.j}, asked[] = {want.p, want.v, want.a, want.j};
    const int last = result.verdict >= Verdict::kBrake ? 3 : 4;  // braking begins with another jerk
    for (int order = 0; order < std::min(last, orders()); ++order)
      EXPECT_LT((got[order] - asked[order]).norm(), 1e-6) << "order " << order;
    EXPECT_NEAR(plan.front().start, request.t0, 1e-12);
    for (size_t i = 0; i + 1 < plan.size(); ++i) {
      const double t = plan[i].end();
      EXPECT_NEAR(plan[i + 1].start, t, 1e-9);
      for (int order = 0; order < 2; ++order)
        EXPECT_LT((plan[i].Derivative(order, t) - plan[i + 1].Derivative(order, t)).norm(), 1e-6);
    }
  }
}

TEST_P(Contract, RepeatsBitForBitWhateverWasAskedBefore) {
  const auto requests = Requests();
  const auto used = Make();
  for (const PlanRequest& request : requests) used->Plan(request);
  for (size_t i : {size_t{1}, size_t{4}, size_t{8}})
    ExpectSameBits(used->Plan(requests[i]), Make()->Plan(requests[i]));
}

/// Safety, sight and limits by sampling far denser than any planner does.
struct Truth {
  bool safe = true, in_sight = true, in_limits = true;
};
Truth Look(const PlanRequest& request, const planning::PlannerConfig& c, const Pieces& plan) {
  constexpr int kSamples = 1000;
  Truth truth;
  for (int i = 0; i <= kSamples; ++i) {
    const double t = request.t0 + (EndOf(plan) - request.t0) * i / kSamples;
    const world::State s = StateAt(plan, t);
    const Vector3d q = request.target.Position(t);
    for (const world::Obstacle& o : request.obstacles) {
      const Eigen::Matrix3d R = world::Inflated(o.shape, c.drone_radius);
      const Vector3d center = o.center.Position(t);
      truth.safe = truth.safe && world::SegmentSquaredDistance(s.p, s.p, center, R) > 0.98;
      truth.in_sight = truth.in_sight && world::SegmentSquaredDistance(s.p, q, center, R) > 0.98;
    }
    truth.in_limits = truth.in_limits && s.v.cwiseAbs().maxCoeff() < 1.01 * c.max_speed &&
                      s.a.cwiseAbs().maxCoeff() < 1.01 * c.max_acceleration &&
                      s.p.z() > c.z_min - 0.01 && s.p.z() < c.z_max + 0.01;
  }
  return truth;
}

TEST_P(Contract, VerdictsClaimNoMoreThanHolds) {
  const auto planner = Make();
  int chases = 0;
  for (const PlanRequest& request : Requests()) {
    const PlanResult plan = planner->Plan(request);
    const Truth truth = Look(request, config(), PiecesOf(plan));
    const bool claims_sight = plan.verdict == Verdict::kChase || plan.verdict == Verdict::kWider ||
                              plan.verdict == Verdict::kKept;
    const bool claims_safety = claims_sight || plan.verdict == Verdict::kSafeOnly;
    chases += claims_sight;
    EXPECT_TRUE(!claims_safety || truth.safe) << planning::Name(plan.verdict) << plan.reason;
    EXPECT_TRUE(!claims_safety || truth.in_limits) << planning::Name(plan.verdict) << plan.reason;
    EXPECT_TRUE(!claims_sight || truth.in_sight) << planning::Name(plan.verdict) << plan.reason;
    // A chase says nothing but which margin had to give way.
    const bool plain = plan.reason.empty() || plan.reason.find("margin of") != std::string::npos;
    EXPECT_EQ(plan.verdict == Verdict::kChase,
              plain && claims_sight && plan.verdict != Verdict::kWider)
        << plan.reason;
  }
  EXPECT_GE(chases, 1) << "a planner that never claims anything proves nothing";
}

TEST_P(Contract, GoesOnFromItsOwnPlan) {
  const auto planner = Make();
  PlanRequest request = RequestAt(MissionOf("S3"), 10.0, 3);
  for (int i = 0; i < 4; ++i) {
    const Pieces plan = PiecesOf(planner->Plan(request));
    const double next = request.t0 + 0.5;
    PlanRequest then = RequestAt(MissionOf("S3"), next, 3);
    then.start = StateAt(plan, next);
    then.running = plan.front();
    then.running_rest.assign(plan.begin() + 1, plan.end());
    const world::State s = StateAt(PiecesOf(planner->Plan(then)), next);
    EXPECT_LT((s.p - then.start.p).norm() + (s.v - then.start.v).norm(), 1e-6);
    request = then;
  }
}

TEST_P(Contract, NeverThrowsAndStaysFinite) {
  const auto planner = Make();
  const PlanRequest good = RequestAt(MissionOf("S6"), 20.0, 5);
  std::vector<PlanRequest> bad(7, good);
  bad[0].obstacles.clear();
  bad[1].start.p = good.target.Position(20.0);  // on top of the target
  bad[2].start.p = good.obstacles[0].center.Position(20.0);
  bad[3].obstacles[0].center = world::Trajectory::Constant(good.target.Position(22.0), 20.0, 5.0);
  bad[4].start.p += Vector3d(500.0, 0.0, 0.0);
  bad[5].start.v = Vector3d(40.0, 0.0, 0.0);
  bad[6].running = world::Trajectory::Constant(good.start.p, 0.0, 1.0);  // long over
  for (size_t i = 0; i < bad.size(); ++i) {
    PlanResult plan;
    ASSERT_NO_THROW(plan = planner->Plan(bad[i])) << i;
    for (const world::Trajectory& piece : PiecesOf(plan)) {
      EXPECT_TRUE(piece.coefficients.allFinite()) << i;
      EXPECT_GT(piece.duration, 0.0) << i;
    }
  }
  PlanRequest broken = good;
  broken.start.v.x() = std::numeric_limits<double>::quiet_NaN();
  PlanResult plan;
  ASSERT_NO_THROW(plan = planner->Plan(broken));
  EXPECT_EQ(plan.verdict, Verdict::kBrake);
}

std::string TestName(const testing::TestParamInfo<std::string>& parameter) {
  std::string name = parameter.param;
  std::replace(name.begin(), name.end(), ':', '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(EveryPlanner, Contract, testing::ValuesIn(Names()), TestName);

TEST(Registry, UnknownNamesAndSetsAreRefusedWithWhatThereIs) {
  const auto message = [](const std::string& name) {
    try {
      Expand(name);
    } catch (const std::invalid_argument& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  EXPECT_NE(message("nobody").find("chase, "), std::string::npos);
  EXPECT_NE(message("penin_style:21").find("it has 20"), std::string::npos);
  EXPECT_NE(message("penin_style:x").find("it has 20"), std::string::npos);
  EXPECT_NE(message("chase:all").find("no parameter sets"), std::string::npos);
  EXPECT_EQ(Expand("naegeli_style:all").size(), 20u);
}

}  // namespace
}  // namespace chase::baselines
