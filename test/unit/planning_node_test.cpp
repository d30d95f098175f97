#include "services/planning/planning_node.h"

#include <gtest/gtest.h>

#include "common/bus/convert.h"
#include "common/bus/lockstep.h"

namespace chase::planning {
namespace {

constexpr int64_t kStart = 1000000;  // us
constexpr int64_t kPeriod = 5000;    // us between poses

polynomial_t Line(int64_t utime, const Eigen::Vector3d& from, const Eigen::Vector3d& velocity) {
  polynomial_t m{};
  m.utime = utime;
  m.duration = 2.5;
  m.n_coefficients = 6;
  for (int i = 0; i < 3; ++i) m.coefficients.push_back(from[i]);
  for (int i = 0; i < 3; ++i) m.coefficients.push_back(2.5 * velocity[i]);
  return m;
}

/// Plays the drone and the target: hovers where the newest plan wants it, forecasts a straight
/// walk.
class Company : public bus::Node {
 public:
  Company(bus::Bus& bus, int64_t forecast_from, int64_t forecast_until)
      : bus_(bus), from_(forecast_from), until_(forecast_until) {
    bus.Subscribe<plan_t>("PLAN", [this](const plan_t& m) { plans.push_back(m); });
  }
  int64_t TickPeriod() const override { return kPeriod; }
  void Tick(int64_t utime) override {
    if (utime >= from_ && utime < until_ && (utime - from_) % 200000 == 0) Forecast(utime);
    if ((utime - kStart) % 100000 == 0) {
      obstacles_t none{};
      none.utime = utime;
      bus_.Publish("OBSTACLES", none);
    }
    pose_t pose{};
    pose.utime = utime;
    pose.orientation[0] = 1.0;
    bus::Set(pose.pos, Position(utime));
    bus_.Publish("POSE", pose);
  }
  std::vector<plan_t> plans;

 private:
  Eigen::Vector3d Position(int64_t utime) const {
    Eigen::Vector3d p(0.0, 0.0, 0.1);
    for (const plan_t& plan : plans) {
      if (plan.utime > utime) continue;
      const auto x = bus::FromMessage(plan.position, kStart);
      p = x.Position(std::min(bus::Seconds(utime, kStart), x.end()));
    }
    return p;
  }
  void Forecast(int64_t utime) {
    prediction_t m{};
    m.utime = utime;
    const double t = bus::Seconds(utime, from_);
    m.target = Line(utime, {2.5 + 0.8 * t, 0.0, 0.6}, {0.8, 0.0, 0.0});
    for (const int i : {0, 4, 8}) m.covariance[i] = m.velocity_covariance[i] = 1e-4;
    bus_.Publish("PREDICTION", m);
  }

  bus::Bus& bus_;
  int64_t from_, until_;
};

std::vector<plan_t> Fly(int64_t forecast_from, int64_t forecast_until, int64_t end) {
  bus::Lockstep lockstep(kStart);
  Company* company = nullptr;
  lockstep.Add("company", 0, [&](bus::Bus& bus) {
    auto node = std::make_unique<Company>(bus, forecast_from, forecast_until);
    company = node.get();
    return node;
  });
  lockstep.Add("planning", 2000,
               [](bus::Bus& bus) { return std::make_unique<PlanningNode>(bus, PlanningConfig{}); });
  lockstep.RunUntil(end);
  return company->plans;
}

bus::Bus::Bytes Bytes(const std::vector<plan_t>& plans) {
  bus::Bus::Bytes all;
  for (const plan_t& plan : plans) {
    bus::Bus::Bytes bytes(static_cast<size_t>(plan.getEncodedSize()));
    plan.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    all.insert(all.end(), bytes.begin(), bytes.end());
  }
  return all;
}

TEST(PlanningNode, ClimbsAndWaitsWithoutAForecast) {
  const auto plans = Fly(kStart + 100000000, 0, kStart + 6000000);
  ASSERT_FALSE(plans.empty());
  for (const plan_t& plan : plans) EXPECT_EQ(+plan.verdict, +plan_t::WAIT) << plan.reason;
  const auto last = bus::FromMessage(plans.back().position, kStart);
  EXPECT_NEAR(last.Position(last.end()).z(), 0.1 + PlanningConfig{}.takeoff_height, 1e-6);
}

TEST(PlanningNode, ChasesAForecastWithoutJumpsFromPlanToPlan) {
  const auto plans = Fly(kStart + 5000000, kStart + 9000000, kStart + 9000000);
  int chases = 0;
  for (size_t i = 1; i < plans.size(); ++i) {
    chases += plans[i].verdict == plan_t::CHASE;
    const auto before = bus::FromMessage(plans[i - 1].position, kStart);
    const auto now = bus::FromMessage(plans[i].position, kStart);
    const double t = std::min(now.start, before.end());
    EXPECT_LT((before.Position(t) - now.Position(now.start)).norm(), 1e-6) << "plan " << i;
    EXPECT_LT((before.Velocity(t) - now.Velocity(now.start)).norm(), 1e-6) << "plan " << i;
  }
  EXPECT_GE(chases, 10);
}

TEST(PlanningNode, StopsAndLooksAroundWhenTheForecastsStop) {
  const auto plans = Fly(kStart + 5000000, kStart + 7000000, kStart + 12000000);
  ASSERT_FALSE(plans.empty());
  EXPECT_TRUE(plans.back().verdict == +plan_t::BRAKE || plans.back().verdict == +plan_t::WAIT);
  EXPECT_FALSE(plans.back().reason.empty());
  const auto last = bus::FromMessage(plans.back().position, kStart);
  EXPECT_LT(last.Velocity(last.end()).norm(), 1e-6);
}

TEST(PlanningNode, TheSameMessagesGiveTheSameBytes) {
  EXPECT_EQ(Bytes(Fly(kStart + 5000000, kStart + 7000000, kStart + 8000000)),
            Bytes(Fly(kStart + 5000000, kStart + 7000000, kStart + 8000000)));
}

}  // namespace
}  // namespace chase::planning
