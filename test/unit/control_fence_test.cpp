// A planner that cares for no fence, control, and a rigid body.
#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>

#include "common/bus/convert.h"
#include "common/world/geofence.h"
#include "test/unit/control_body.h"
#include "test/unit/control_node_bench.h"

namespace chase::control {
namespace {

using Eigen::Vector3d;
using test::Bench;
using test::kStart;
using world::Trajectory;

constexpr int64_t kPose = 5000;        // us
constexpr double kPeriod = 0.2;        // s between plans
constexpr double kStopsAfter = 0.3;    // s: a plan's stop begins
const Vector3d kHome(3.0, -2.0, 0.4);  // frame W, m

/// An L: along x, and at its end along y.
world::Geofence Angle() {
  world::Geofence fence;
  fence.polygon = {{-1, -1}, {4, -1}, {4, 4}, {2.5, 4}, {2.5, 1}, {-1, 1}};
  fence.ceiling = 3.0;
  return fence;
}

/// From a state to rest at `goal`.
Trajectory ToRest(const world::State& s, const Vector3d& goal, double start, double duration) {
  const Vector3d v = duration * s.v, a = duration * duration * s.a, d = goal - s.p;
  Trajectory way{start, duration, Eigen::MatrixXd::Zero(6, 3)};
  way.coefficients << s.p.transpose(), v.transpose(), 0.5 * a.transpose(),
      (10.0 * d - 6.0 * v - 1.5 * a).transpose(), (-15.0 * d + 8.0 * v + 1.5 * a).transpose(),
      (6.0 * d - 3.0 * v - 0.5 * a).transpose();
  return way;
}

class Chase {
 public:
  explicit Chase(unsigned seed) : random_(seed), bench_(true, Config()) {
    body.p = kHome + Vector3d(0.0, 0.0, 1.0);
    way_ = stop_ = Trajectory::Constant(body.p, 0.0, 1e-3);
    bench_.SendState(flight_state_t::CHASE, "mission", kHome);
    Pose();
    bench_.SendPlan(kStart, body.p, 0.5);
  }

  void Step(bool is_planned) {
    t += 1e-6 * kPose;
    if (is_planned && t >= next_) Plan();
    Pose();
    if (bench_.out.empty()) return;
    const attitude_setpoint_t& m = bench_.out.back();
    body.Step({bus::ToQuaternion(m.orientation), bus::ToVector(m.body_rate), m.thrust});
  }

  int refused() const {
    const std::string detail = bench_.node().Report().detail;
    return std::stoi(detail.substr(detail.find(" plans, ") + 8));
  }

  test::Body body;
  double t = 0.0;  // s since kStart
  int plans = 0;

 private:
  static ControlConfig Config() {
    ControlConfig config;
    config.geofence = Angle();
    return config;
  }

  void Pose() {
    pose_t m{};
    m.utime = bus::Utime(t, kStart);
    bus::Set(m.pos, body.p);
    bus::Set(m.vel, body.v);
    bus::Set(m.accel, body.a);
    bus::Set(m.orientation, body.q);
    bench_.Send(m);
  }

  /// Somewhere inside or out, by a plan whose stop may leave where the plan does not and the other
  /// way round. The next one goes on from what control flies.
  void Plan() {
    std::uniform_real_distribution<double> u(0.0, 1.0);
    next_ += kPeriod;
    if (u(random_) < 0.2)
      goal_ = kHome + Vector3d(-2 + 7 * u(random_), -2 + 7 * u(random_), 4 * u(random_));
    const world::State now = At(t + 0.01);
    const double far = (goal_ - now.p).norm();
    const Trajectory way = ToRest(now, goal_, t + 0.01, std::max(1.5, far / 0.8));
    const double leaves = t + 0.01 + kStopsAfter;
    world::State then = way.At(leaves);
    const double braking = std::max(0.6, 1.5 * then.v.norm());
    const Trajectory stop = ToRest(then, then.p + 0.4 * braking * then.v, leaves, braking);
    plan_t m = Bench::Certified(bus::Utime(way.start, kStart), now.p);
    m.n_proofs = 0;
    m.proofs.clear();
    m.position = bus::ToMessage(way, kStart);
    m.stop = bus::ToMessage(stop, kStart);
    const int before = refused();
    obstacles_t none{};
    none.utime = bus::Utime(t, kStart);
    bench_.Send(none);
    bench_.RunUntil(none.utime);
    bench_.Send(m);
    bench_.RunUntil(bus::Utime(t, kStart));
    ++plans;
    if (refused() != before) return;
    way_ = way;
    stop_ = stop;
  }

  world::State At(double when) const {
    const Trajectory& flown = when < stop_.start ? way_ : stop_;
    if (when < flown.end()) return flown.At(when);
    world::State rest;
    rest.p = flown.Position(flown.end());
    return rest;
  }

  std::mt19937 random_;
  Bench bench_;
  Trajectory way_, stop_;
  Vector3d goal_ = kHome + Vector3d(2.0, 0.0, 1.0);
  double next_ = 0.3;
};

TEST(Fence, HoldsTheBodyWhateverIsPlanned) {
  const world::Geofence fence = Angle();
  for (unsigned seed = 1; seed <= 10; ++seed) {
    Chase chase(seed);
    double way = 0.0;
    bool near = false;
    while (chase.t < 40.0) {
      chase.Step(chase.t < 37.0);
      way += 1e-6 * kPose * chase.body.v.norm();
      const Vector3d p = chase.body.p - kHome;
      ASSERT_EQ(fence.Breach(p), "")
          << "seed " << seed << ", " << chase.t << " s: " << p.transpose();
      near = near || !fence.Breach(p, 0.3).empty();
    }
    EXPECT_LT(chase.body.v.norm(), 0.02) << "at rest once nobody plans";
    EXPECT_GT(way, 5.0) << "seed " << seed;
    EXPECT_TRUE(near) << "seed " << seed;
    EXPECT_GT(chase.refused(), 20) << "seed " << seed;
    EXPECT_GT(chase.plans - chase.refused(), 20) << "seed " << seed;
  }
}

}  // namespace
}  // namespace chase::control
