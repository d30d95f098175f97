#include <gtest/gtest.h>

#include <cstdio>

#include "deploy/calibrate/camera_fit.h"
#include "deploy/calibrate/rig_file.h"
#include "test/unit/calibrate_scene.h"

namespace chase::calibrate {
namespace {

using namespace testing;

std::vector<View> Views(const Board& board, double tilt) {
  world::Random random(7);
  std::vector<View> views;
  for (int k = 0; k < 14; ++k) {
    const Vector3d turned(random.Uniform(-tilt, tilt), random.Uniform(-tilt, tilt),
                          random.Uniform(-0.3, 0.3));
    const Vector3d middle(random.Uniform(-0.2, 0.2), random.Uniform(-0.15, 0.15),
                          random.Uniform(0.9, 1.4));
    views.push_back(FindBoard(Photo(board, BoardAt(board, turned, middle)), board));
  }
  return views;
}

TEST(Calibrate, TheCameraIsFoundWithinItsSigmas) {
  const Board board;
  const std::vector<View> views = Views(board, 0.6);
  for (const View& view : views) EXPECT_GT(view.ids.size(), 12u);
  const CameraFit fit = FitCamera(views, kSize);
  ASSERT_EQ(fit.problem, "");
  std::printf("focal %.2f +- %.2f, centre %.2f %.2f +- %.2f, rms %.3f px\n", fit.focal_px,
              fit.focal_sigma, fit.center_u_px, fit.center_v_px, fit.center_sigma, fit.rms_px);
  EXPECT_NEAR(fit.focal_px, kFocal, 0.005 * kFocal);
  EXPECT_NEAR(fit.center_u_px, kU, 3.0);
  EXPECT_NEAR(fit.center_v_px, kV, 3.0);
  EXPECT_LT(fit.rms_px, 0.3);
}

TEST(Calibrate, ViewsThatLeaveTheFocalLengthOpenAreRefused) {
  const Board board;
  EXPECT_NE(FitCamera(Views(board, 0.01), kSize).problem.find("parallel"), std::string::npos);
  std::vector<View> few = Views(board, 0.6);
  few.resize(4);
  EXPECT_NE(FitCamera(few, kSize).problem.find("4 pictures"), std::string::npos);
  EXPECT_TRUE(FindBoard(cv::Mat(kSize, CV_8UC3, cv::Scalar::all(90)), board).empty());
}

// What its terms make of the corners would be anything.
TEST(Calibrate, ALensOfWhichTheCornersWereNotShownIsRefused) {
  Board board;
  std::vector<View> views;
  for (int k = 0; k < 10; ++k) {
    const double around = 0.7 * k;
    const Vector3d turned(0.6 * std::cos(around), 0.6 * std::sin(around), 0.0);
    views.push_back(FindBoard(Photo(board, BoardAt(board, turned, {0, 0, 1.6}), kBarrel), board));
  }
  EXPECT_NE(FitCamera(views, kSize).problem.find("corners"), std::string::npos);
}

struct Case {
  std::vector<Plane> planes;
  Isometry3d truth, guess;
};

Case MakeCase(uint64_t seed, double tilt, int poses) {
  Board board;
  board.square = 0.14, board.marker = 0.105;
  world::Random random(seed);
  const world::Rig rig;
  Case c;
  c.guess = LidarInCamera(rig);
  c.truth = c.guess;
  c.truth.translation() += Vector3d(0.05, -0.04, 0.06);
  c.truth.linear() = AngleAxisd(0.06, Vector3d(1, -2, 1).normalized()) * c.truth.linear();
  for (int k = 0; k < poses; ++k) {
    const double around = 2.4 * k;
    const Vector3d turned(tilt * std::cos(around), tilt * std::sin(around),
                          0.2 * std::sin(5.0 * k));
    const Vector3d middle(random.Uniform(-0.3, 0.3), random.Uniform(-0.3, 0.1),
                          random.Uniform(1.5, 2.5));
    c.planes.push_back(Swept(board, BoardAt(board, turned, middle), c.truth, &random));
  }
  return c;
}

TEST(Calibrate, TheLidarIsFoundWithinItsSigmas) {
  double worst = 0.0;
  for (uint64_t seed = 1; seed <= 8; ++seed) {
    const Case c = MakeCase(seed, 0.6, 10);
    const LidarFit fit = FitLidar(c.planes, c.guess);
    ASSERT_EQ(fit.problem, "") << seed;
    const Vector3d shift = fit.X_CL.translation() - c.truth.translation();
    const AngleAxisd turn(Eigen::Matrix3d(fit.X_CL.linear() * c.truth.linear().transpose()));
    const Vector3d angle = turn.angle() * turn.axis();
    EXPECT_LT(shift.norm(), 0.02) << seed;
    EXPECT_LT(angle.norm(), 0.01) << seed;
    EXPECT_NEAR(fit.rms, 0.02, 0.006) << seed;
    worst = std::max({worst, shift.cwiseQuotient(fit.position_sigma).cwiseAbs().maxCoeff(),
                      angle.cwiseQuotient(fit.rotation_sigma).cwiseAbs().maxCoeff()});
    std::printf("seed %d: %.1f mm, %.3f degrees off; sigmas %.1f mm, %.3f degrees\n",
                static_cast<int>(seed), 1e3 * shift.norm(), angle.norm() * 180.0 / M_PI,
                1e3 * fit.position_sigma.maxCoeff(), fit.rotation_sigma.maxCoeff() * 180.0 / M_PI);
  }
  EXPECT_LT(worst, 4.5) << "sigmas";
}

TEST(Calibrate, ParallelPlanesAreRefused) {
  const Case c = MakeCase(1, 0.02, 10);
  EXPECT_NE(FitLidar(c.planes, c.guess).problem.find("three directions"), std::string::npos);
  EXPECT_NE(FitLidar({}, c.guess).problem, "");
}

TEST(Calibrate, TheRigKeepsWhatTheFitFound) {
  const Case c = MakeCase(1, 0.6, 1);
  const world::Rig rig = WithLidar(world::Rig{}, c.truth);
  EXPECT_LT((LidarInCamera(rig).matrix() - c.truth.matrix()).norm(), 1e-9);
}

}  // namespace
}  // namespace chase::calibrate
