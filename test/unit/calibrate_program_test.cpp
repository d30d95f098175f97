#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <lcm/lcm-cpp.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>

#include "chase/camera_image_t.hpp"
#include "chase/imu_t.hpp"
#include "chase/lidar_scan_t.hpp"
#include "common/world/view_angles.h"
#include "deploy/calibrate/rig_file.h"
#include "test/unit/calibrate_scene.h"

namespace chase::calibrate {
namespace {

using namespace testing;

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

camera_image_t MessageOf(const cv::Mat& photo) {
  camera_image_t image{};
  image.width = photo.cols, image.height = photo.rows, image.row_stride = 3 * photo.cols;
  image.pixelformat = camera_image_t::PIXEL_FORMAT_BGR;
  image.size = image.row_stride * image.height;
  image.data.assign(photo.datastart, photo.dataend);
  return image;
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
    camera_image_t image = MessageOf(photo);
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

/// A log in which someone turns the vehicle before a board that stands; images are stamped late.
void WriteTurns(const std::string& file, const Board& board, const Isometry3d& X_BC, double late) {
  lcm::LogFile log(file, "w");
  const auto X_WB = [](double t) {
    return Isometry3d(AngleAxisd(0.2 * std::sin(3.3 * t), Vector3d::UnitZ()) *
                      AngleAxisd(0.15 * std::sin(5.3 * t), Vector3d::UnitY()) *
                      AngleAxisd(0.2 * std::sin(4.1 * t), Vector3d::UnitX()));
  };
  const Isometry3d X_WP = X_BC * BoardAt(board, {0.2, -0.2, 0.0}, {0.0, 0.0, 1.6});
  for (int ms = 1000; ms < 8000; ms += 5) {
    const double t = 1e-3 * ms;
    const AngleAxisd turn((X_WB(t - 1e-4).inverse() * X_WB(t + 1e-4)).rotation());
    imu_t imu{};
    imu.utime = 1000 * ms;
    Vector3d::Map(imu.gyro) = turn.angle() / 2e-4 * turn.axis();
    Write(&log, "IMU", imu);
    if (ms % 100 != 0) continue;
    const cv::Mat photo = Photo(board, (X_WB(t) * X_BC).inverse() * X_WP);
    camera_image_t image = MessageOf(photo);
    image.utime = 1000 * ms + static_cast<int64_t>(1e6 * late);
    Write(&log, "CAMERA_IMAGE", image);
  }
}

int Pixels(const cv::Mat& picture, const cv::Scalar& bgr) {
  cv::Mat mask;
  cv::inRange(picture, bgr, bgr, mask);
  return cv::countNonZero(mask);
}

TEST(CalibrateProgram, FromALogOfTurnsToTheCamerasRotation) {
  const std::string folder = ::testing::TempDir() + "calibrate_imu/";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  Board board;
  board.square = 0.14, board.marker = 0.105;
  RigFile rig;
  rig.rig.width_px = kSize.width, rig.rig.height_px = kSize.height;
  rig.rig.focal_px = kFocal, rig.rig.center_u_px = kU, rig.rig.center_v_px = kV;
  std::ofstream(folder + "rig.yaml") << config::Dump(rig);
  RigFile askew = rig;
  askew.rig.camera_roll_deg = 2.0, askew.rig.camera_yaw_deg = -3.0, askew.rig.camera_pitch_deg = 9;
  Isometry3d X_BC = Isometry3d::Identity();
  X_BC.linear() = askew.rig.R_BC();
  WriteTurns(folder + "log.lcm", board, X_BC, 0.04);
  const std::string call = "imu " + folder + "log.lcm --square 0.14 --marker 0.105 --rig " +
                           folder + "rig.yaml --out " + folder + "found.yaml --check " + folder +
                           "imu.png";
  ASSERT_EQ(std::system((CHASE_CALIBRATE " " + call + " > " + folder + "said").c_str()), 0);
  RigFile found;
  config::Load(folder + "found.yaml", &found);
  EXPECT_LT(AngleAxisd(Eigen::Matrix3d(found.rig.R_BC() * X_BC.linear().transpose())).angle(),
            0.005);
  std::stringstream said;
  said << std::ifstream(folder + "said").rdbuf();
  const std::string text = said.str(), before = "stamps are ";
  const std::size_t at = text.find(before);
  ASSERT_NE(at, std::string::npos) << text;
  EXPECT_NEAR(std::stod(text.substr(at + before.size())), 40.0, 3.0) << text;
  const world::ViewAngles view = world::ViewOf(found.rig);
  // A line each, as chase-log identify --update wants planning.yaml.
  EXPECT_NE(text.find(fmt::format("planner:\n  view_down_deg: {:.1f}\n  view_up_deg: {:.1f}\n"
                                  "  max_bearing_deg: {:.1f}\n",
                                  view.down, view.up, view.bearing)),
            std::string::npos)
      << text;
  const cv::Mat picture = cv::imread(folder + "imu.png");
  ASSERT_FALSE(picture.empty());
  EXPECT_GT(Pixels(picture, {40, 40, 40}), 500) << "dots of the camera's turns";
  EXPECT_GT(Pixels(picture, {60, 200, 60}), 5000) << "the gyroscope's";
  EXPECT_GT(Pixels(picture, {60, 60, 230}), 500) << "their difference";
  WriteLog(folder + "no_imu.lcm", board, LidarInCamera(rig.rig));
  EXPECT_NE(Call("imu " + folder + "no_imu.lcm"), 0);
}

}  // namespace
}  // namespace chase::calibrate
