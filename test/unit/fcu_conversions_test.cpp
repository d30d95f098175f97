#include <gtest/gtest.h>

#include "common/math/rotation.h"
#include "common/mavlink/frames.h"
#include "common/world/random.h"
#include "services/fcu/conversions.h"

namespace chase::fcu {
namespace {

Eigen::Vector3d RandomVector(world::Random* random) {
  return {random->Gaussian(), random->Gaussian(), random->Gaussian()};
}

Eigen::Quaterniond RandomRotation(world::Random* random) {
  return math::ExpSO3(2.0 * RandomVector(random));
}

Eigen::Quaterniond Quaternion(const std::array<float, 4>& q) { return {q[0], q[1], q[2], q[3]}; }

TEST(FcuFrames, AxesByHand) {
  EXPECT_EQ(SwapWorld({1, 0, 0}), Eigen::Vector3d(0, 1, 0)) << "east";
  EXPECT_EQ(SwapWorld({0, 1, 0}), Eigen::Vector3d(1, 0, 0)) << "north";
  EXPECT_EQ(SwapWorld({0, 0, 1}), Eigen::Vector3d(0, 0, -1)) << "up";
  EXPECT_EQ(SwapBody({1, 2, 3}), Eigen::Vector3d(1, -2, -3));
  // Level with the nose to the north: yaw 90 degrees in W, no rotation in NED.
  const Eigen::Quaterniond north = SwapFrames(math::FromYaw(M_PI / 2));
  EXPECT_NEAR(north.w(), 1.0, 1e-12);
  // Level with the nose to the east: a quarter turn to the right about down.
  const Eigen::Quaterniond east = SwapFrames(Eigen::Quaterniond::Identity());
  EXPECT_NEAR(east.angularDistance(math::FromYaw(M_PI / 2)), 0.0, 1e-12);
}

TEST(FcuFrames, TheMapsAgreeAndAreTheirOwnInverse) {
  world::Random random(1);
  for (int i = 0; i < 2000; ++i) {
    const Eigen::Vector3d v = RandomVector(&random);
    const Eigen::Quaterniond R = RandomRotation(&random);
    EXPECT_LT((SwapWorld(SwapWorld(v)) - v).norm(), 1e-12);
    EXPECT_LT((WorldSwap() * v - SwapWorld(v)).norm(), 1e-12);
    EXPECT_LT((BodySwap() * v - SwapBody(v)).norm(), 1e-12);
    EXPECT_LT(SwapFrames(SwapFrames(R)).angularDistance(R), 1e-7);
    // A vector taken through both worlds.
    EXPECT_LT((SwapFrames(R) * SwapBody(v) - SwapWorld(R * v)).norm(), 1e-9);
  }
}

TEST(FcuConversions, ExternalVisionIsTheSameBodyInPx4sFrames) {
  world::Random random(2);
  for (int i = 0; i < 500; ++i) {
    Pose pose;
    pose.utime = 1'700'000'000'000'001;
    pose.p_WB = RandomVector(&random);
    pose.v_WB = RandomVector(&random);
    pose.w_WB_B = RandomVector(&random);
    pose.R_WB = RandomRotation(&random);
    const mav::Odometry m = ExternalVision(pose, 3);
    const Eigen::Quaterniond R = Quaternion(m.q);
    EXPECT_EQ(m.time_usec, 1'700'000'000'000'001u);
    EXPECT_LT((Eigen::Vector3d(m.x, m.y, m.z) - SwapWorld(pose.p_WB)).norm(), 1e-5);
    EXPECT_LT((R * Eigen::Vector3d(m.vx, m.vy, m.vz) - SwapWorld(pose.v_WB)).norm(), 1e-5);
    EXPECT_LT((R * Eigen::Vector3d(m.rollspeed, m.pitchspeed, m.yawspeed) -
               SwapWorld(pose.R_WB * pose.w_WB_B))
                  .norm(),
              1e-5);
    EXPECT_EQ(m.reset_counter, 3);
    EXPECT_EQ(m.frame_id, 20);        // MAV_FRAME_LOCAL_FRD
    EXPECT_EQ(m.child_frame_id, 12);  // MAV_FRAME_BODY_FRD
    EXPECT_EQ(m.estimator_type, 3);   // VIO
  }
}

/// Where row, column of a 6x6 matrix lies in its upper triangle.
std::size_t Place(int row, int column) {
  if (row > column) std::swap(row, column);
  return static_cast<std::size_t>(row * 6 - row * (row - 1) / 2 + column - row);
}

// Samples of the errors, moved one by one into PX4's frames, have the covariance that is sent.
TEST(FcuConversions, CovarianceIsThatOfSamplesInPx4sFrames) {
  world::Random random(3);
  Pose pose;
  pose.R_WB = RandomRotation(&random);
  Matrix9d A;
  for (int i = 0; i < 81; ++i) A(i / 9, i % 9) = random.Gaussian();
  pose.covariance = A * A.transpose();
  using Vector9d = Eigen::Matrix<double, 9, 1>;
  using Vector6d = Eigen::Matrix<double, 6, 1>;
  Eigen::Matrix<double, 6, 6> P = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix3d V = Eigen::Matrix3d::Zero();
  constexpr int kSamples = 200'000;
  for (int i = 0; i < kSamples; ++i) {
    Vector9d e;
    for (int k = 0; k < 9; ++k) e[k] = random.Gaussian();
    e = A * e;
    Vector6d moved;
    moved << SwapWorld(e.head<3>()), SwapWorld(e.tail<3>());
    const Eigen::Vector3d v = SwapBody(pose.R_WB.conjugate() * e.segment<3>(3));
    P += moved * moved.transpose() / kSamples;
    V += v * v.transpose() / kSamples;
  }
  const mav::Odometry m = ExternalVision(pose, 0);
  const double scale = pose.covariance.diagonal().maxCoeff();
  for (int r = 0; r < 6; ++r)
    for (int c = 0; c < 6; ++c) {
      EXPECT_NEAR(m.pose_covariance[Place(r, c)], P(r, c), 0.02 * scale) << r << c;
      if (r >= 3 || c >= 3) continue;
      EXPECT_NEAR(m.velocity_covariance[Place(r, c)], V(r, c), 0.02 * scale);
    }
}

TEST(FcuConversions, ThrustMeetsTheMotorCurve) {
  for (double hover : {0.2, 0.49, 0.8})
    for (double curve : {0.0, 0.3, 1.0}) {
      EXPECT_NEAR(ThrustShare(9.81, hover, curve), hover, 1e-12);
      EXPECT_EQ(ThrustShare(0.0, hover, curve), 0.0);
      EXPECT_EQ(ThrustShare(-3.0, hover, curve), 0.0);
      EXPECT_EQ(ThrustShare(1000.0, hover, curve), 1.0);
      const double u = ThrustShare(12.0, hover, curve);
      const auto push = [&](double x) { return curve * x * x + (1 - curve) * x; };
      if (u == 1.0) continue;
      EXPECT_NEAR(push(u) / push(hover), 12.0 / 9.81, 1e-12);
    }
}

TEST(FcuConversions, AttitudeTargetInBothForms) {
  world::Random random(4);
  FcuConfig config;
  Setpoint setpoint;
  setpoint.R_WB = RandomRotation(&random);
  setpoint.w_WB_B = {0.1, -0.2, 0.3};
  setpoint.thrust = 9.81;
  setpoint.motors = true;
  mav::SetAttitudeTarget m = AttitudeTarget(setpoint, setpoint.R_WB, config);
  EXPECT_EQ(m.type_mask, 3) << "roll and pitch rate ignored";
  EXPECT_LT(Quaternion(m.q).angularDistance(SwapFrames(setpoint.R_WB)), 1e-3);
  EXPECT_NEAR(m.body_yaw_rate, -(setpoint.R_WB * setpoint.w_WB_B).z(), 1e-6);
  EXPECT_NEAR(m.thrust, config.hover_thrust, 1e-6);
  config.body_rates = true;
  m = AttitudeTarget(setpoint, setpoint.R_WB, config);
  EXPECT_EQ(m.type_mask, 128) << "the attitude ignored";
  EXPECT_NEAR(m.body_roll_rate, 0.1, 1e-6);
  EXPECT_NEAR(m.body_pitch_rate, 0.2, 1e-6);
  EXPECT_NEAR(m.body_yaw_rate, -0.3, 1e-6);
  setpoint.motors = false;
  EXPECT_EQ(AttitudeTarget(setpoint, setpoint.R_WB, config).thrust, 0.0f);
}

// Rates towards the setpoint end there, from anywhere.
TEST(FcuConversions, TheAttitudeLoopConverges) {
  world::Random random(5);
  FcuConfig config;
  config.body_rates = true;
  for (int trial = 0; trial < 50; ++trial) {
    Setpoint setpoint;
    setpoint.R_WB = RandomRotation(&random);
    Eigen::Quaterniond R = RandomRotation(&random);
    for (int i = 0; i < 1000; ++i) {
      const auto m = AttitudeTarget(setpoint, R, config);
      const Eigen::Vector3d w = SwapBody({m.body_roll_rate, m.body_pitch_rate, m.body_yaw_rate});
      EXPECT_LE(w.cwiseAbs().maxCoeff(), config.max_rate + 1e-6);
      R = (R * math::ExpSO3(0.005 * w)).normalized();
    }
    EXPECT_LT(R.angularDistance(setpoint.R_WB), 0.01);
  }
}

TEST(FcuConversions, ImuAtRestPointsUp) {
  mav::HighresImu high;
  high.zacc = -9.8f, high.xgyro = 0.1f, high.ygyro = 0.2f;
  EXPECT_NEAR(FromMessage(high).accel.z(), 9.8, 1e-5);
  EXPECT_NEAR(FromMessage(high).gyro.y(), -0.2, 1e-6);
  mav::ScaledImu scaled;
  scaled.time_boot_ms = 7;
  scaled.zacc = -1000, scaled.ygyro = 500;
  EXPECT_NEAR(FromMessage(scaled).accel.z(), 9.80665, 1e-6);
  EXPECT_NEAR(FromMessage(scaled).gyro.y(), -0.5, 1e-6);
  EXPECT_EQ(FromMessage(scaled).utime, 7000);
}

}  // namespace
}  // namespace chase::fcu
