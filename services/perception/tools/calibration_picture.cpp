#include "services/perception/tools/calibration_picture.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <lcm/lcm-cpp.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <stdexcept>

#include "common/bus/validation.h"
#include "common/config/config.h"
#include "common/config/version.h"
#include "services/perception/messages.h"
#include "services/perception/sensors/camera.h"

namespace chase::perception {

namespace {

constexpr double kFarthest = 15.0;  // m, the end of the colour scale
constexpr int kScale = 3;           // picture px a pixel

template <class T>
std::optional<T> Decode(const lcm::LogEvent& event) {
  try {
    T m;
    if (m.decode(event.data, 0, event.datalen) == event.datalen && bus::Problem(m).empty())
      return m;
  } catch (const std::exception&) {  // generated decoders throw on negative lengths
  }
  return std::nullopt;
}

/// What a log holds around one frame.
struct Recording {
  PoseHistory poses;
  std::optional<Frame> frame;
  std::optional<Sweep> sweep;
};

/// Reads on from the first readable frame at or after `at` seconds until a sweep has been logged
/// and poses surround the frame.
Recording ReadAround(const std::string& in, double at) {
  lcm::LogFile log(in, "r");
  if (!log.good()) throw std::runtime_error(in + ": cannot be read; name an LCM log");
  Recording r;
  std::optional<int64_t> origin;
  while (const lcm::LogEvent* event = log.readNextEvent()) {
    if (event->channel == "CAMERA_IMAGE") {
      const auto m = Decode<camera_image_t>(*event);
      if (!m) continue;
      if (!origin) origin = m->utime;
      Frame frame = FromMessage(*m, *origin);
      if (!r.frame && frame.t >= at && frame.problem.empty()) r.frame = frame;
    } else if (event->channel == "POSE") {
      const auto m = Decode<pose_t>(*event);
      if (m && origin && Usable(*m)) r.poses.Add(FromMessage(*m, *origin));
    } else if (event->channel == "LIDAR_SCAN" && r.frame) {
      const auto m = Decode<lidar_scan_t>(*event);
      if (m) r.sweep = FromMessage(*m, *origin);
    }
    if (r.frame && r.sweep && r.poses.At(r.frame->t, 0.0)) return r;
  }
  throw std::runtime_error(
      in + ": no CAMERA_IMAGE with LIDAR_SCAN and POSE after it; try an earlier --at");
}

void DrawPoint(const Camera& camera, const Eigen::Vector3d& p_W, cv::Mat* picture) {
  const auto px = camera.Project(p_W);
  if (!px) return;
  const double range = (p_W - camera.p_WC).norm();
  cv::Mat level(1, 1, CV_8U, cv::Scalar(255.0 * std::min(1.0, range / kFarthest))), color;
  cv::applyColorMap(level, color, cv::COLORMAP_JET);
  const auto& c = color.at<cv::Vec3b>(0, 0);
  const cv::Point at(static_cast<int>(std::lround(kScale * (px->x() + 0.5))),
                     static_cast<int>(std::lround(kScale * (px->y() + 0.5))));
  cv::circle(*picture, at, 2, cv::Scalar(c[0], c[1], c[2]), cv::FILLED);
}

}  // namespace

void WriteCalibrationPicture(const std::string& in, const std::string& out,
                             const std::string& config_file, double at) {
  PerceptionConfig config;
  if (!config_file.empty()) config::Load(config_file, &config);
  const Recording r = ReadAround(in, at);
  const Camera camera = CameraAt(*r.poses.At(r.frame->t, 0.0), config.rig);
  cv::Mat picture;
  cv::resize(r.frame->bgr, picture, {}, kScale, kScale, cv::INTER_NEAREST);
  for (size_t i = 0; i < r.sweep->points.size(); ++i) {
    const auto pose = r.poses.At(r.sweep->t + static_cast<double>(r.sweep->times[i]), 0.02);
    if (!pose) continue;
    const Eigen::Vector3d p_B =
        config.rig.lidar_position + config.rig.R_BL() * r.sweep->points[i].cast<double>();
    DrawPoint(camera, pose->p_WB + pose->R_WB * p_B, &picture);
  }
  if (!cv::imwrite(out, picture))
    throw std::runtime_error(out + ": cannot be written; name a .png in an existing folder");
}

int CheckCalibration(int argc, char** argv) {
  CLI::App app("Projects LiDAR points into a frame of a log.", "chase-perception");
  chase::config::AddVersion(&app);
  std::string in, out = "calibration.png", config;
  double at = 1.0;
  app.add_option("--check-calibration", in, "LCM log with CAMERA_IMAGE, LIDAR_SCAN and POSE")
      ->required();
  app.add_option("--out", out, "picture to write");
  app.add_option("--config", config, "YAML file with the rig, as for the service");
  app.add_option("--at", at, "s after the log's first image");
  try {
    app.parse(argc, argv);
    WriteCalibrationPicture(in, out, config, at);
    std::printf("%s\n", out.c_str());
    return 0;
  } catch (const CLI::Success& e) {  // --help
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    std::fprintf(stderr, "chase-perception: %s; see --check-calibration LOG --out PNG\n", e.what());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "chase-perception: %s\n", e.what());
  }
  return 1;
}

}  // namespace chase::perception
