#include <gtest/gtest.h>

#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "common/world/random.h"
#include "deploy/calibrate/board.h"
#include "deploy/calibrate/camera_fit.h"
#include "deploy/calibrate/lidar_fit.h"
#include "deploy/calibrate/rig_file.h"

namespace chase::calibrate {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kFocal = 610.0, kU = 322.0, kV = 236.0;
const cv::Size kSize(640, 480);

/// The board at this pose, its middle at `middle` in C.
Isometry3d BoardAt(const Board& board, const Vector3d& turned, const Vector3d& middle) {
  Isometry3d X = Isometry3d::Identity();
  X.linear() =
      (AngleAxisd(turned.z(), Vector3d::UnitZ()) * AngleAxisd(turned.y(), Vector3d::UnitY()) *
       AngleAxisd(turned.x(), Vector3d::UnitX()))
          .toRotationMatrix();
  X.translation() = middle - X.linear() * Vector3d(0.5 * board.columns * board.square,
                                                   0.5 * board.rows * board.square, 0.0);
  return X;
}

/// The board as a pinhole camera sees it, by the homography of its plane.
cv::Mat Photo(const Board& board, const Isometry3d& X_CP) {
  const cv::Mat picture = board.Picture(80);
  std::vector<cv::Point2f> from, to;
  for (const cv::Point3f& corner : board.Outline()) {
    const Vector3d p = X_CP * Vector3d(corner.x, corner.y, 0.0);
    from.emplace_back(static_cast<float>(corner.x / board.square * 80.0 - 0.5),
                      static_cast<float>(corner.y / board.square * 80.0 - 0.5));
    to.emplace_back(static_cast<float>(kU + kFocal * p.x() / p.z()),
                    static_cast<float>(kV + kFocal * p.y() / p.z()));
  }
  cv::Mat photo;
  cv::warpPerspective(picture, photo, cv::getPerspectiveTransform(from, to), kSize, cv::INTER_AREA,
                      cv::BORDER_CONSTANT, cv::Scalar(128));
  cv::GaussianBlur(photo, photo, {3, 3}, 0.7);
  cv::cvtColor(photo, photo, cv::COLOR_GRAY2BGR);
  return photo;
}

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

/// Rays of a VLP-16 onto the board or onto a wall behind it, with 2 cm of noise.
Plane Swept(const Board& board, const Isometry3d& X_CP, const Isometry3d& X_CL,
            world::Random* random) {
  Plane plane;
  plane.X_CP = X_CP;
  plane.size = {board.columns * board.square, board.rows * board.square};
  const Isometry3d X_LC = X_CL.inverse(), X_LP = X_LC * X_CP;
  const Vector3d n = X_LP.linear().col(2), o = X_LP.translation();
  for (int ring = -15; ring <= 15; ring += 2)
    for (int step = -225; step <= 225; ++step) {  // 90 degrees ahead
      const double e = ring * M_PI / 180.0, a = 0.2 * step * M_PI / 180.0;
      const Vector3d ray(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
      double range = 5.0 / ray.x();
      const double on_plane = n.dot(o) / n.dot(ray);
      const Vector3d at = X_LP.inverse() * (on_plane * ray);
      if (on_plane > 0.0 && at.x() > 0 && at.x() < plane.size.x() && at.y() > 0 &&
          at.y() < plane.size.y())
        range = on_plane;
      plane.points.push_back((range + 0.02 * random->Gaussian()) * ray);
    }
  return plane;
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
