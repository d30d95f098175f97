#include <gtest/gtest.h>

#include <cmath>

#include "common/math/rotation.h"
#include "services/control/tracking_law.h"

namespace chase::control {
namespace {

using Eigen::Vector3d;

TEST(AttitudeFor, PointsThrustAndNose) {
  const Vector3d thrust(2.0, -3.0, 9.0);
  const Setpoint s = AttitudeFor(thrust, Vector3d::Zero(), 0.8, 0.0);
  EXPECT_LT((s.R_WB * Vector3d::UnitZ() - thrust.normalized()).norm(), 1e-12);
  // The body's y axis stays level with respect to the wanted heading: no component along it.
  EXPECT_NEAR((s.R_WB * Vector3d::UnitY()).dot(Vector3d(std::cos(0.8), std::sin(0.8), 0)), 0,
              1e-12);
  EXPECT_NEAR(s.thrust, thrust.norm(), 1e-12);
}

TEST(AttitudeFor, BodyRateIsTheDerivativeOfTheAttitude) {
  const double h = 1e-5;
  for (int i = 0; i < 50; ++i) {
    const Vector3d f(3 * std::sin(i), 3 * std::cos(2 * i), 9.0 + 2 * std::sin(3 * i));
    const Vector3d f_rate(5 * std::cos(5 * i), 5 * std::sin(7 * i), 3 * std::cos(11 * i));
    const double yaw = 0.5 * i, yaw_rate = std::sin(13 * i);
    const auto at = [&](double t) {
      return AttitudeFor(f + t * f_rate, f_rate, yaw + t * yaw_rate, yaw_rate).R_WB;
    };
    const Vector3d numeric = math::LogSO3(at(-h).conjugate() * at(h)) / (2 * h);
    const Vector3d w = AttitudeFor(f, f_rate, yaw, yaw_rate).w_WB_B;
    EXPECT_LT((w - numeric).norm(), 1e-6) << i;
  }
}

TEST(LimitThrust, LeavesFeasibleThrustAlone) {
  const Vector3d thrust(1.0, 2.0, 9.81);
  EXPECT_LT((LimitThrust(thrust, {}) - thrust).norm(), 1e-12);
}

TEST(LimitThrust, KeepsVerticalPartFirst) {
  const ControlConfig config;
  const Vector3d limited = LimitThrust({100.0, 0.0, 12.0}, config);
  EXPECT_NEAR(limited.z(), 12.0, 1e-12);
  EXPECT_NEAR(std::atan2(limited.x(), limited.z()) * 180 / M_PI, config.tilt_limit_deg, 1e-9);
  EXPECT_NEAR(LimitThrust({5.0, 5.0, 100.0}, config).norm(), config.max_thrust, 1e-9);
}

TEST(LimitThrust, GuardsFreeFall) {
  const ControlConfig config;
  for (const Vector3d& thrust : {Vector3d(0, 0, 0), Vector3d(3, 0, 0), Vector3d(0, 0, -50)}) {
    const Vector3d limited = LimitThrust(thrust, config);
    EXPECT_DOUBLE_EQ(limited.z(), config.min_thrust);
    EXPECT_TRUE(AttitudeFor(limited, Vector3d::Zero(), 0.0, 0.0).R_WB.coeffs().allFinite());
  }
}

TEST(TrackingLaw, FreeFallReferenceGivesAnAttitude) {
  TrackingLaw law({});
  Reference fall;
  fall.state.a = {0, 0, -kGravity};
  fall.state.j = {50, -50, 0};
  const Setpoint s = law.Track({}, fall, fall, 0.005);
  EXPECT_TRUE(s.R_WB.coeffs().allFinite());
  EXPECT_TRUE(s.w_WB_B.allFinite());
  EXPECT_GE(s.thrust, ControlConfig{}.min_thrust);
}

TEST(TrackingLaw, HoversAtRest) {
  TrackingLaw law({});
  const Setpoint s = law.Track({}, {}, {}, 0.005);
  EXPECT_NEAR(s.thrust, kGravity, 1e-12);
  EXPECT_NEAR(s.R_WB.w(), 1.0, 1e-12);
  EXPECT_LT(s.w_WB_B.norm(), 1e-12);
}

TEST(TrackingLaw, FeedsDragForward) {
  ControlConfig config;
  Reference along;
  along.state.v = {2.0, -1.0, 0.5};
  Estimate estimate;
  estimate.v_WB = along.state.v;
  const Setpoint s = TrackingLaw(config).Track(estimate, along, along, 0.0);
  const Vector3d up = s.R_WB * Vector3d::UnitZ();
  const Vector3d wanted = config.drag.cwiseProduct(along.state.v) + Vector3d(0.0, 0.0, kGravity);
  EXPECT_LT((up - wanted.normalized()).norm(), 1e-9);
}

TEST(TrackingLaw, IntegralIsLimited) {
  ControlConfig config;
  TrackingLaw law(config);
  Reference above;
  above.state.p = {0.5, -0.5, 0.5};
  for (int i = 0; i < 10000; ++i) law.Track({}, above, above, 0.005);
  EXPECT_DOUBLE_EQ(law.integral().x(), config.integral_limit);
  EXPECT_DOUBLE_EQ(law.integral().y(), -config.integral_limit);
}

// Whatever is cut off by the limits, the integral does not grow into it, and asked the other way it
// comes back at once.
TEST(TrackingLaw, AntiWindupUnderEveryLimit) {
  ControlConfig config;
  config.tilt_limit_deg = 10.0;
  config.max_thrust = 12.0;
  config.catch_up_speed = 20.0;  // no error is far
  for (const Eigen::Vector3d& way : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, -1, 0),
                                     Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0, 0, -1)}) {
    TrackingLaw law(config);
    Reference reference;
    reference.state.p = 2.0 * way;
    for (int i = 0; i < 400; ++i) {
      const Setpoint setpoint = law.Track({}, reference, reference, 0.005);
      EXPECT_LE(setpoint.thrust, config.max_thrust + 1e-9);
      EXPECT_GE(setpoint.thrust, config.min_thrust - 1e-9);
      EXPECT_LE(setpoint.w_WB_B.cwiseAbs().maxCoeff(), config.max_body_rate + 1e-9);
      const double tilt = (setpoint.R_WB * Eigen::Vector3d::UnitZ()).z();
      EXPECT_GE(tilt, std::cos(config.tilt_limit_deg * M_PI / 180.0) - 1e-9);
    }
    EXPECT_EQ(law.integral().dot(way), 0.0) << way.transpose();
    reference.state.p = -0.05 * way;  // within the limits
    law.Track({}, reference, reference, 0.005);
    EXPECT_LT(law.integral().dot(way), 0.0) << way.transpose();
  }
}

TEST(TrackingLaw, IntegralIgnoresGapsAndFarStarts) {
  TrackingLaw law({});
  Reference r;
  r.state.p = {0.1, 0, 0};
  law.Track({}, r, r, 1e9);
  EXPECT_LT(law.integral().norm(), 0.02);
  TrackingLaw far({});
  r.state.p = {50, 0, 0};
  for (int i = 0; i < 1000; ++i) far.Track({}, r, r, 0.005);
  EXPECT_EQ(far.integral().norm(), 0.0);
}

TEST(TrackingLaw, TurnsInStepsOfMaxYawErrorTheShortWay) {
  ControlConfig config;
  TrackingLaw law(config);
  Estimate e;
  e.R_WB = math::FromYaw(3.0);
  Reference r;
  r.yaw = -3.0 + 4 * M_PI;  // 0.28 rad further on, unwrapped twice
  EXPECT_NEAR(math::WrapAngle(math::Yaw(law.Track(e, r, r, 0.0).R_WB) + 3.0), 0.0, 1e-9);
  r.yaw = 3.0 - 2.0;
  EXPECT_NEAR(math::Yaw(law.Track(e, r, r, 0.0).R_WB), 3.0 - config.max_yaw_error, 1e-9);
}

}  // namespace
}  // namespace chase::control
