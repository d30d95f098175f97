#include <gtest/gtest.h>

#include <cstdio>
#include <opencv2/core.hpp>

#include "common/math/rotation.h"
#include "common/world/random.h"
#include "deploy/calibrate/camera_fit.h"
#include "deploy/calibrate/imu_fit.h"
#include "deploy/calibrate/rig_file.h"
#include "services/simulator/imu.h"

namespace chase::calibrate {
namespace {

using Eigen::Isometry3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kDegree = M_PI / 180.0;

/// Someone turns the vehicle in front of a board that stands, about these axes of B, rad.
struct Hands {
  Vector3d amplitude = {0.25, 0.2, 0.25};
  Quaterniond At(double t) const {
    const Vector3d angle(std::sin(4.1 * t), std::sin(5.3 * t + 1.0), std::sin(3.3 * t + 2.0));
    return math::ExpSO3(amplitude.cwiseProduct(angle));
  }
  Vector3d Rate(double t) const {
    constexpr double kStep = 1e-5;
    return math::LogSO3(At(t - kStep).conjugate() * At(t + kStep)) / (2.0 * kStep);
  }
};

struct Recording {
  std::vector<Turned> seen;
  std::vector<Gyro> gyro;
};

/// By the simulator's gyroscope and a camera whose corners have 0.3 px of noise.
Recording Record(const Hands& hands, const world::Rig& rig, double delay, uint64_t seed,
                 double seconds = 30.0) {
  Recording recording;
  simulator::Imu imu(simulator::ImuConfig{}, seed);
  world::Random random(seed);
  const Board board;
  Isometry3d X_BC = Isometry3d::Identity();
  X_BC.linear() = rig.R_BC();
  X_BC.translation() = rig.camera_position;
  Isometry3d X_CP = Isometry3d::Identity();  // at rest; seen at right angles its tilt is vague
  X_CP.linear() = math::ExpSO3({0.35, -0.35, 0.0}).toRotationMatrix();
  X_CP.translation() = Vector3d(0.0, 0.0, 1.0) - X_CP.linear() * Vector3d(0.35, 0.25, 0.0);
  const Isometry3d X_WP = X_BC * X_CP;
  for (double t = 0.0; t < seconds; t += 0.005) {
    simulator::BodyState state;
    state.q = hands.At(t);
    state.w = hands.Rate(t);
    recording.gyro.push_back({t, imu.Measure(state, 0.005).gyro});
  }
  for (double t = 0.5; t < seconds - 0.5; t += 0.05) {
    X_CP = (Isometry3d(hands.At(t)) * X_BC).inverse() * X_WP;
    View view;
    for (int id = 0; id < board.corners(); ++id) {
      const cv::Point3f at = board.Corner(id);
      const Vector3d p = X_CP * Vector3d(at.x, at.y, at.z);
      const Eigen::Vector2d px =
          rig.Project(p) + 0.3 * Eigen::Vector2d(random.Gaussian(), random.Gaussian());
      const bool inside =
          px.x() > 0 && px.x() < rig.width_px && px.y() > 0 && px.y() < rig.height_px;
      if (p.z() <= 0.0 || !inside) continue;
      view.ids.push_back(id);
      view.px.emplace_back(static_cast<float>(px.x()), static_cast<float>(px.y()));
      view.at.push_back(at);
    }
    cv::Vec3d rotation, position;
    if (BoardPose(view, rig, &rotation, &position))
      recording.seen.push_back({t + delay, math::ExpSO3({rotation[0], rotation[1], rotation[2]})});
  }
  return recording;
}

/// The built-in camera, mounted some degrees askew.
world::Rig Askew() {
  const world::Rig rig;
  const Quaterniond turn = math::ExpSO3({0.05, -0.03, 0.04});
  return WithCamera(rig, rig.R_BC() * turn.toRotationMatrix());
}

TEST(CalibrateImu, RotationAndDelayAreFoundWithinTheirSigmas) {
  double worst = 0.0;
  for (uint64_t seed = 1; seed <= 12; ++seed) {
    const double delay = 0.02 * static_cast<double>(seed) - 0.13;
    const Recording r = Record(Hands(), Askew(), delay, seed);
    const ImuFit fit = FitImu(r.seen, r.gyro);
    ASSERT_EQ(fit.problem, "") << seed;
    const Vector3d off = math::LogSO3(fit.R_BC.conjugate() * Quaterniond(Askew().R_BC()));
    EXPECT_LT(off.norm(), 0.3 * kDegree) << seed;
    EXPECT_NEAR(fit.delay, delay, 0.003) << seed;
    worst = std::max({worst, off.cwiseQuotient(fit.rotation_sigma).cwiseAbs().maxCoeff(),
                      std::abs(fit.delay - delay) / fit.delay_sigma});
    EXPECT_LT(fit.rotation_sigma.maxCoeff(), 0.1 * kDegree);
    std::printf("seed %d: %.3f degrees, %.2f ms off; sigmas %.3f degrees, %.2f ms; turns %.2f\n",
                static_cast<int>(seed), off.norm() / kDegree, 1e3 * (fit.delay - delay),
                fit.rotation_sigma.maxCoeff() / kDegree, 1e3 * fit.delay_sigma, fit.rms / kDegree);
  }
  EXPECT_LT(worst, 4.5) << "sigmas";
}

/// What the checking picture draws.
TEST(CalibrateImu, ComparedTurnsAgreeWithTheFitAndAreInOrder) {
  const Recording r = Record(Hands(), Askew(), 0.1, 2);
  const ImuFit fit = FitImu(r.seen, r.gyro);
  ASSERT_GT(fit.compared.size(), 500u) << "20 a second";
  double errors = 0.0, turns = 0.0, last = 0.0;
  for (const ComparedTurn& turn : fit.compared) {
    EXPECT_GT(turn.t, last);
    last = turn.t;
    errors += (turn.camera - turn.gyro).squaredNorm();
    turns += turn.camera.squaredNorm();
  }
  const double n = 3.0 * static_cast<double>(fit.compared.size());
  EXPECT_NEAR(std::sqrt(errors / n), fit.rms, 0.2 * fit.rms);
  EXPECT_GT(std::sqrt(turns / n), 20.0 * fit.rms);
}

TEST(CalibrateImu, TurnsAboutOneAxisAndShortRecordingsAreRefused) {
  const Recording one = Record({{0.0, 0.0, 0.3}}, Askew(), 0.0, 1);
  EXPECT_NE(FitImu(one.seen, one.gyro).problem.find("one axis"), std::string::npos);
  const Recording brief = Record(Hands(), Askew(), 0.0, 1, 2.0);
  EXPECT_NE(FitImu(brief.seen, brief.gyro).problem.find("for 20 s"), std::string::npos);
  Recording deaf = Record(Hands(), Askew(), 0.0, 1);
  deaf.gyro.resize(200);
  EXPECT_NE(FitImu(deaf.seen, deaf.gyro).problem.find("IMU covers few"), std::string::npos);
  EXPECT_NE(FitImu({}, {}).problem, "");
}

TEST(CalibrateImu, ADelayBeyondWhatIsSearchedIsRefused) {
  for (const double delay : {-0.23, 0.23, 0.35}) {
    const Recording r = Record(Hands(), Askew(), delay, 1);
    const ImuFit fit = FitImu(r.seen, r.gyro);
    EXPECT_NE(fit.problem.find("200 ms"), std::string::npos)
        << delay << ": " << fit.delay << " s, " << fit.rms << " rad off; " << fit.problem;
  }
}

TEST(CalibrateImu, StepsThatDoNotEndAreRefused) {
  Recording r = Record(Hands(), Askew(), 0.0, 1);
  world::Random random(3);
  for (Turned& turned : r.seen)  // nothing that both measure
    turned.R_CP =
        math::ExpSO3(Vector3d(random.Uniform(-3, 3), random.Uniform(-3, 3), random.Uniform(-3, 3)));
  const std::string problem = FitImu(r.seen, r.gyro).problem;
  EXPECT_NE(problem.find("do not settle"), std::string::npos) << problem;
}

TEST(CalibrateImu, AFewWrongPosesOfTheBoardDoNotMoveIt) {
  Recording r = Record(Hands(), Askew(), 0.03, 3);
  for (std::size_t i = 5; i < r.seen.size(); i += 40)
    r.seen[i].R_CP = r.seen[i].R_CP * math::ExpSO3({0.5, 0.0, 0.0});
  const ImuFit fit = FitImu(r.seen, r.gyro);
  EXPECT_LT(fit.R_BC.angularDistance(Quaterniond(Askew().R_BC())), 0.3 * kDegree);
  EXPECT_NEAR(fit.delay, 0.03, 0.003);
}

TEST(CalibrateImu, TheRigTurnsTheCameraAsItSays) {
  world::Rig rig;
  rig.camera_pitch_deg = 0.0, rig.camera_yaw_deg = 90.0;
  EXPECT_LT((rig.R_BC().col(2) - Vector3d::UnitY()).norm(), 1e-12) << "it looks to the left";
  EXPECT_LT((rig.R_BC().col(0) - Vector3d::UnitX()).norm(), 1e-12);
  rig.camera_yaw_deg = 0.0, rig.camera_roll_deg = 90.0;
  EXPECT_LT((rig.R_BC().col(2) - Vector3d::UnitX()).norm(), 1e-12);
  EXPECT_LT((rig.R_BC().col(0) + Vector3d::UnitZ()).norm(), 1e-12) << "its right side is down";
}

TEST(CalibrateImu, TheLidarStaysWhereTheCameraSawIt) {
  const world::Rig rig, askew = Askew();
  EXPECT_GT((rig.R_BC() - askew.R_BC()).norm(), 0.05);
  EXPECT_LT((LidarInCamera(rig).matrix() - LidarInCamera(askew).matrix()).norm(), 1e-9);
  const world::Rig again = WithCamera(askew, rig.R_BC());
  EXPECT_NEAR(again.camera_pitch_deg, rig.camera_pitch_deg, 1e-9);
  EXPECT_NEAR(again.camera_yaw_deg, 0.0, 1e-9);
  EXPECT_NEAR(again.camera_roll_deg, 0.0, 1e-9);
}

}  // namespace
}  // namespace chase::calibrate
