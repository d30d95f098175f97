#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <stdexcept>

#include "common/config/version.h"
#include "common/world/view_angles.h"
#include "deploy/calibrate/pictures.h"
#include "deploy/calibrate/rig_file.h"
#include "deploy/calibrate/sweep_picture.h"
#include "deploy/calibrate/turns.h"

namespace chase::calibrate {
namespace {

constexpr double kWorstRms = 1.0;  // px: above it the model or the board's sizes are wrong
constexpr int kPrintedPx = 120;    // a square

struct Arguments {
  Board board;
  std::string rig, out, check, log;
  std::vector<std::string> pictures;
  double at = 1.0;  // s
};

void Require(const std::string& problem) {
  if (!problem.empty()) throw std::runtime_error(problem);
}

void WritePicture(const std::string& file, const cv::Mat& picture) {
  if (picture.empty() || !cv::imwrite(file, picture))
    throw std::runtime_error(file + ": cannot be written; name a .png in an existing folder");
}

RigFile LoadRig(const std::string& file) {
  RigFile rig;
  if (!file.empty()) config::Load(file, &rig);
  return rig;
}

void WriteRig(const std::string& file, const RigFile& rig) {
  std::ofstream out(file);
  if (!(out << config::Dump(rig)))
    throw std::runtime_error(file + ": cannot be written; name a .yaml in an existing folder");
}

/// What planning's file says of the rig, which planning itself does not read.
void PrintView(const world::Rig& rig) {
  const world::ViewAngles view = world::ViewOf(rig);
  fmt::print(
      "for planning's --config:\n"
      "planner:\n  view_down_deg: {:.1f}\n  view_up_deg: {:.1f}\n  max_bearing_deg: {:.1f}\n",
      view.down, view.up, view.bearing);
}

int WriteBoard(const Arguments& a) {
  Require(a.board.Problem());
  WritePicture(a.out, a.board.Picture(kPrintedPx));
  fmt::print("{}: print it so that a square measures {:g} m, and glue it onto something flat\n",
             a.out, a.board.square);
  return 0;
}

int Camera(const Arguments& a) {
  Require(a.board.Problem());
  RigFile rig = LoadRig(a.rig);
  std::vector<View> views;
  cv::Size size;
  for (const std::string& file : a.pictures) {
    const cv::Mat bgr = cv::imread(file, cv::IMREAD_COLOR);
    if (bgr.empty()) throw std::runtime_error(file + ": no picture that OpenCV reads");
    if (size.area() > 0 && bgr.size() != size)
      throw std::runtime_error(
          fmt::format("{}: {} x {} px, the pictures before {} x {}; give those "
                      "of one camera",
                      file, bgr.cols, bgr.rows, size.width, size.height));
    size = bgr.size();
    views.push_back(FindBoard(bgr, a.board));
    fmt::print("{}: {} of {} corners\n", file, views.back().ids.size(), a.board.corners());
  }
  const CameraFit fit = FitCamera(views, size);
  Require(fit.problem);
  rig.rig = fit.In(rig.rig, size);
  Require(rig.Problem());
  WritePicture(a.check, CameraPicture(views, rig.rig));
  if (fit.rms_px > kWorstRms)
    throw std::runtime_error(fmt::format(
        "the corners are {:.2f} px off, more than {:g}, see {}: check --square, --marker and the "
        "board's flatness, leave blurred pictures out, and take a lens that is no fisheye",
        fit.rms_px, kWorstRms, a.check));
  WriteRig(a.out, rig);
  fmt::print(
      "focal length {:.2f} +- {:.2f} px, centre {:.2f} {:.2f} +- {:.2f} px, lens {} {:.4f} {:.4f}, "
      "corners {:.2f} px off ({:.2f} px by a pinhole)\n{}\n{}\n",
      fit.focal_px, fit.focal_sigma, fit.center_u_px, fit.center_v_px, fit.center_sigma,
      rig.rig.lens, fit.k1, fit.k2, fit.rms_px, fit.pinhole_rms_px, a.out, a.check);
  PrintView(rig.rig);
  return 0;
}

int Lidar(const Arguments& a) {
  Require(a.board.Problem());
  RigFile rig = LoadRig(a.rig);
  const Eigen::Isometry3d before = LidarInCamera(rig.rig);
  const Sightings sightings = ReadSightings(a.log, a.board, rig.rig);
  fmt::print("{} images, {} show the board, {} sweeps; it stood still {} times\n", sightings.images,
             sightings.seen, sightings.sweeps, sightings.planes.size());
  const LidarFit fit = FitLidar(sightings.planes, before);
  Require(fit.problem);
  rig.rig = WithLidar(rig.rig, fit.X_CL);
  WriteRig(a.out, rig);
  WritePicture(a.check, LidarPicture(sightings, fit, before, rig.rig));
  const Eigen::Vector3d& p = rig.rig.lidar_position;
  const Eigen::Vector3d& r = rig.rig.lidar_rpy_deg;
  fmt::print(
      "lidar at {:.3f} {:.3f} {:.3f} m, {:.2f} {:.2f} {:.2f} degrees; points {:.1f} mm off "
      "their planes; sigmas {:.1f} mm, {:.2f} degrees at most\n{}\n{}\n",
      p.x(), p.y(), p.z(), r.x(), r.y(), r.z(), 1e3 * fit.rms, 1e3 * fit.position_sigma.maxCoeff(),
      fit.rotation_sigma.maxCoeff() * 180.0 / M_PI, a.out, a.check);
  return 0;
}

int Imu(const Arguments& a) {
  Require(a.board.Problem());
  RigFile rig = LoadRig(a.rig);
  const Turns turns = ReadTurns(a.log, a.board, rig.rig);
  fmt::print("{} images, {} show the board, {} samples of the IMU\n", turns.images,
             turns.seen.size(), turns.gyro.size());
  const ImuFit fit = FitImu(turns.seen, turns.gyro);
  Require(fit.problem);
  constexpr double kDegree = M_PI / 180.0, kWorst = 1.0 * kDegree;
  const bool holds = fit.rms <= kWorst;
  if (holds) {
    rig.rig = WithCamera(rig.rig, fit.R_BC.toRotationMatrix());
    WriteRig(a.out, rig);
  }
  WritePicture(a.check, ImuPicture(fit));
  if (!holds)
    throw std::runtime_error(fmt::format(
        "the camera's turns are {:.1f} degrees off the IMU's, see {}: check --square, --marker and "
        "--rig, and that the board stood still",
        fit.rms / kDegree, a.check));
  fmt::print(
      "camera's roll, pitch, yaw {:.2f} {:.2f} {:.2f} +- {:.2f} degrees, by {} turns that are "
      "{:.2f} degrees off; its stamps are {:.1f} +- {:.1f} ms late: add {:.4f} to camera.yaml's "
      "stamp_delay\n{}\n{}\n",
      rig.rig.camera_roll_deg, rig.rig.camera_pitch_deg, rig.rig.camera_yaw_deg,
      fit.rotation_sigma.maxCoeff() / kDegree, fit.turns, fit.rms / kDegree, 1e3 * fit.delay,
      1e3 * fit.delay_sigma, fit.delay, a.out, a.check);
  PrintView(rig.rig);
  return 0;
}

int Check(const Arguments& a) {
  WritePicture(a.check, SweepPicture(a.log, LoadRig(a.rig).rig, a.at));
  fmt::print("{}\n", a.check);
  return 0;
}

void AddBoard(CLI::App* app, Board* board) {
  app->add_option("--columns", board->columns, "squares along the board")->capture_default_str();
  app->add_option("--rows", board->rows, "squares across")->capture_default_str();
  app->add_option("--square", board->square, "edge of a square as printed, m")
      ->capture_default_str();
  app->add_option("--marker", board->marker, "edge of a marker as printed, m")
      ->capture_default_str();
}

void AddOutputs(CLI::App* app, Arguments* a) {
  app->add_option("--rig", a->rig, "YAML file with the rig so far (default: built in)");
  app->add_option("--out", a->out,
                  "YAML file to write, for --config of odometry, perception, viewer and simulator")
      ->capture_default_str();
  app->add_option("--check", a->check, "picture to look at")->capture_default_str();
}

int Run(int argc, char** argv) {
  CLI::App app("Calibrates the camera, and the LiDAR's place to it, with a ChArUco board.",
               "chase-calibrate");
  chase::config::AddVersion(&app);
  app.require_subcommand(1);
  Arguments board, camera, lidar, imu, check;
  board.out = "board.png";
  camera.out = lidar.out = imu.out = "rig.yaml";
  camera.check = "check-camera.png";
  check.check = "calibration.png";
  lidar.check = "check-lidar.png";
  imu.check = "check-imu.png";
  CLI::App* b = app.add_subcommand("board", "Writes the board to print.");
  AddBoard(b, &board.board);
  b->add_option("--out", board.out, "picture to write")->capture_default_str();
  CLI::App* c =
      app.add_subcommand("camera", "Focal length, centre and lens from pictures of the board.");
  c->add_option("pictures", camera.pictures, "of the size that chase-camera publishes")->required();
  AddBoard(c, &camera.board);
  AddOutputs(c, &camera);
  CLI::App* l = app.add_subcommand("lidar", "Pose of the LiDAR from a log with the board.");
  l->add_option("log", lidar.log, "LCM log with CAMERA_IMAGE and LIDAR_SCAN")->required();
  AddBoard(l, &lidar.board);
  AddOutputs(l, &lidar);
  CLI::App* i =
      app.add_subcommand("imu", "Rotation of the camera and delay of its stamps by the IMU.");
  i->add_option("log", imu.log,
                "LCM log with CAMERA_IMAGE and IMU, turned before a board that stands")
      ->required();
  AddBoard(i, &imu.board);
  AddOutputs(i, &imu);
  CLI::App* k = app.add_subcommand("check", "Draws a sweep's points into a frame of a log.");
  k->add_option("log", check.log, "LCM log with CAMERA_IMAGE, LIDAR_SCAN and POSE")->required();
  k->add_option("--rig", check.rig, "YAML file with the rig (default: built in)");
  k->add_option("--at", check.at, "s after the log's first image")->capture_default_str();
  k->add_option("--out", check.check, "picture to write")->capture_default_str();
  try {
    app.parse(argc, argv);
    if (k->parsed()) return Check(check);
    if (i->parsed()) return Imu(imu);
    return b->parsed() ? WriteBoard(board) : c->parsed() ? Camera(camera) : Lidar(lidar);
  } catch (const CLI::Success& e) {  // --help
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    fmt::print(stderr, "chase-calibrate: {}; see chase-calibrate --help\n", e.what());
  } catch (const std::exception& e) {
    fmt::print(stderr, "chase-calibrate: {}\n", e.what());
  }
  return 1;
}

}  // namespace
}  // namespace chase::calibrate

int main(int argc, char** argv) { return chase::calibrate::Run(argc, argv); }
