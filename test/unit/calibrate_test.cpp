#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <lcm/lcm-cpp.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "chase/camera_image_t.hpp"
#include "chase/lidar_scan_t.hpp"
#include "common/world/random.h"
#include "deploy/calibrate/board.h"
#include "deploy/calibrate/camera_fit.h"
#include "deploy/calibrate/lidar_fit.h"
#include "deploy/calibrate/rig_file.h"

namespace chase::calibrate {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector2d;
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

/// k1, k2 of a lens that bends lines by 20 px at the picture's corners.
const cv::Vec4d kPinhole(0, 0, 0, 0), kBarrel(-0.22, 0.05, 0, 0);

const cv::Mat& Matrix() {
  static const cv::Mat matrix = (cv::Mat_<double>(3, 3) << kFocal, 0, kU, 0, kFocal, kV, 0, 0, 1);
  return matrix;
}

/// The board as a camera sees it: each pixel's ray through OpenCV's model of the lens, and through
/// the homography of the board's plane.
cv::Mat Photo(const Board& board, const Isometry3d& X_CP, const cv::Vec4d& lens = kPinhole) {
  std::vector<cv::Point2f> seen, on_board;
  for (const cv::Point3f& corner : board.Outline()) {
    const Vector3d p = X_CP * Vector3d(corner.x, corner.y, 0.0);
    on_board.emplace_back(static_cast<float>(corner.x / board.square * 80.0 - 0.5),
                          static_cast<float>(corner.y / board.square * 80.0 - 0.5));
    seen.emplace_back(static_cast<float>(p.x() / p.z()), static_cast<float>(p.y() / p.z()));
  }
  std::vector<cv::Point2f> pixels, rays, map;
  for (int v = 0; v < kSize.height; ++v)
    for (int u = 0; u < kSize.width; ++u)
      pixels.emplace_back(static_cast<float>(u), static_cast<float>(v));
  cv::undistortPoints(pixels, rays, Matrix(), lens, cv::noArray(), cv::noArray(),
                      {cv::TermCriteria::COUNT, 20, 0.0});
  cv::perspectiveTransform(rays, map, cv::getPerspectiveTransform(seen, on_board));
  cv::Mat photo;
  cv::remap(board.Picture(80), photo, cv::Mat(map).reshape(2, kSize.height), cv::noArray(),
            cv::INTER_LINEAR, cv::BORDER_CONSTANT, cv::Scalar(128));
  cv::GaussianBlur(photo, photo, {3, 3}, 0.7);
  cv::cvtColor(photo, photo, cv::COLOR_GRAY2BGR);
  return photo;
}

/// The farthest that a rig puts a point from where that lens shows it, anywhere in the picture, px.
double FarthestOff(const world::Rig& rig, const cv::Vec4d& lens) {
  double most = 0.0;
  for (double x = -0.5; x <= 0.5; x += 0.05)
    for (double y = -0.36; y <= 0.36; y += 0.04) {
      std::vector<cv::Point2d> px;
      cv::projectPoints(std::vector<cv::Point3d>{{x, y, 1.0}}, cv::Vec3d(), cv::Vec3d(), Matrix(),
                        lens, px);
      most = std::max(most, (rig.Project({x, y, 1.0}) - Vector2d(px[0].x, px[0].y)).norm());
    }
  return most;
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

template <class T>
void Write(lcm::LogFile* log, const char* channel, T message) {
  std::vector<uint8_t> bytes(static_cast<std::size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  lcm::LogEvent event;
  event.eventnum = 0;
  event.timestamp = message.utime;
  event.channel = channel;
  event.data = bytes.data();
  event.datalen = static_cast<int>(bytes.size());
  log->writeEvent(&event);
}

/// A log in which someone holds the board still for half a second at each pose.
void WriteLog(const std::string& file, const Board& board, const Isometry3d& X_CL,
              const cv::Vec4d& lens = kPinhole) {
  lcm::LogFile log(file, "w");
  world::Random random(3);
  int64_t utime = 1'000'000;
  for (int k = 0; k < 8; ++k) {
    const double around = 2.4 * k;
    const Isometry3d X_CP = BoardAt(board, {0.6 * std::cos(around), 0.6 * std::sin(around), 0.1},
                                    {0.0, 0.0, 1.6 + 0.05 * k});
    const cv::Mat photo = Photo(board, X_CP, lens);
    const Plane plane = Swept(board, X_CP, X_CL, &random);
    lidar_scan_t scan{};
    scan.size = static_cast<int32_t>(plane.points.size());
    for (const Vector3d& p : plane.points) {
      scan.x.push_back(static_cast<float>(p.x()));
      scan.y.push_back(static_cast<float>(p.y()));
      scan.z.push_back(static_cast<float>(p.z()));
      scan.t.push_back(0.05f);
      scan.intensity.push_back(50), scan.ring.push_back(0);
    }
    camera_image_t image{};
    image.width = photo.cols, image.height = photo.rows, image.row_stride = 3 * photo.cols;
    image.pixelformat = camera_image_t::PIXEL_FORMAT_BGR;
    image.size = image.row_stride * image.height;
    image.data.assign(photo.datastart, photo.dataend);
    for (int i = 0; i < 10; ++i, utime += 50'000) {
      image.utime = utime;
      Write(&log, "CAMERA_IMAGE", image);
      scan.utime = utime - 20'000;
      if (i % 2 == 0) Write(&log, "LIDAR_SCAN", scan);
    }
    utime += 300'000;
  }
}

int Call(const std::string& arguments) {
  return std::system((CHASE_CALIBRATE " " + arguments + " > /dev/null 2>&1").c_str());
}

TEST(CalibrateProgram, FromPicturesAndALogToARigAndPicturesToLookAt) {
  const std::string folder = ::testing::TempDir() + "calibrate/";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  Board board;
  board.square = 0.14, board.marker = 0.105;
  const std::string sizes = " --square 0.14 --marker 0.105 ";
  ASSERT_EQ(Call("board --out " + folder + "board.png"), 0);
  EXPECT_FALSE(cv::imread(folder + "board.png").empty());
  world::Random random(5);
  for (int k = 0; k < 10; ++k) {
    const Vector3d turned(random.Uniform(-0.6, 0.6), random.Uniform(-0.6, 0.6), 0.0);
    cv::imwrite(folder + "p" + std::to_string(k) + ".png",
                Photo(board, BoardAt(board, turned, {0.02 * k, -0.02 * k, 1.3 + 0.05 * k})));
  }
  ASSERT_EQ(Call("camera " + folder + "p*.png" + sizes + "--out " + folder + "rig.yaml --check " +
                 folder + "camera.png"),
            0);
  Isometry3d truth = LidarInCamera(world::Rig{});
  truth.translation() += Vector3d(0.05, -0.04, 0.06);
  WriteLog(folder + "log.lcm", board, truth);
  ASSERT_EQ(Call("lidar " + folder + "log.lcm" + sizes + "--rig " + folder + "rig.yaml --out " +
                 folder + "rig.yaml --check " + folder + "lidar.png"),
            0);
  RigFile found;
  config::Load(folder + "rig.yaml", &found);
  EXPECT_EQ(found.rig.width_px, 640);
  EXPECT_NEAR(found.rig.focal_px, kFocal, 0.01 * kFocal);
  EXPECT_LT((LidarInCamera(found.rig).translation() - truth.translation()).norm(), 0.03);
  EXPECT_FALSE(cv::imread(folder + "camera.png").empty());
  EXPECT_FALSE(cv::imread(folder + "lidar.png").empty());
  EXPECT_NE(Call("lidar " + folder + "none.lcm"), 0);
  EXPECT_NE(Call("camera " + folder + "board.png"), 0) << "one picture is not enough";
}

/// Pictures of the board over the whole of what the camera sees.
void WritePictures(const std::string& folder, const Board& board, const cv::Vec4d& lens) {
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  world::Random random(5);
  for (int k = 0; k < 16; ++k) {
    const Vector3d turned(random.Uniform(-0.6, 0.6), random.Uniform(-0.6, 0.6), 0.0);
    const Vector3d middle(random.Uniform(-0.5, 0.5), random.Uniform(-0.4, 0.4), 1.3);
    cv::imwrite(folder + "p" + std::to_string(k) + ".png",
                Photo(board, BoardAt(board, turned, middle), lens));
  }
}

TEST(CalibrateProgram, ALensThatBendsLinesIsInTheRigAndTheLidarIsFoundThroughIt) {
  const std::string folder = ::testing::TempDir() + "calibrate_lens/";
  Board board;
  board.square = 0.14, board.marker = 0.105;
  const std::string sizes = " --square 0.14 --marker 0.105 ", rig = folder + "rig.yaml";
  WritePictures(folder, board, kBarrel);
  ASSERT_EQ(Call("camera " + folder + "p*.png" + sizes + "--out " + rig + " --check " + folder +
                 "camera.png"),
            0);
  RigFile found;
  config::Load(rig, &found);
  EXPECT_EQ(found.rig.lens, "plumb_bob");
  EXPECT_NEAR(found.rig.lens_coefficients[0], kBarrel[0], 0.02);
  EXPECT_LT(FarthestOff(found.rig, kBarrel), 2.0);
  Isometry3d truth = LidarInCamera(world::Rig{});
  truth.translation() += Vector3d(0.05, -0.04, 0.06);
  WriteLog(folder + "log.lcm", board, truth, kBarrel);
  ASSERT_EQ(Call("lidar " + folder + "log.lcm" + sizes + "--rig " + rig + " --out " + rig +
                 " --check " + folder + "lidar.png"),
            0);
  config::Load(rig, &found);
  EXPECT_EQ(found.rig.lens, "plumb_bob");
  EXPECT_LT((LidarInCamera(found.rig).translation() - truth.translation()).norm(), 0.02);
}

TEST(CalibrateProgram, APinholeStaysOne) {
  const std::string folder = ::testing::TempDir() + "calibrate_pinhole/";
  Board board;
  board.square = 0.14, board.marker = 0.105;
  WritePictures(folder, board, kPinhole);
  ASSERT_EQ(Call("camera " + folder + "p*.png --square 0.14 --marker 0.105 --out " + folder +
                 "rig.yaml --check " + folder + "camera.png"),
            0);
  RigFile found;
  config::Load(folder + "rig.yaml", &found);
  std::printf("lens %s, k1 %.4f, k2 %.4f, %.2f px off\n", found.rig.lens.c_str(),
              found.rig.lens_coefficients[0], found.rig.lens_coefficients[1],
              FarthestOff(found.rig, kPinhole));
  EXPECT_LT(FarthestOff(found.rig, kPinhole), 1.5);
}

TEST(Calibrate, TheRigKeepsWhatTheFitFound) {
  const Case c = MakeCase(1, 0.6, 1);
  const world::Rig rig = WithLidar(world::Rig{}, c.truth);
  EXPECT_LT((LidarInCamera(rig).matrix() - c.truth.matrix()).norm(), 1e-9);
}

}  // namespace
}  // namespace chase::calibrate
