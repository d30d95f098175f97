#include "deploy/calibrate/sweep_picture.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <stdexcept>

#include "deploy/calibrate/decode.h"
#include "services/perception/messages.h"

namespace chase::calibrate {

namespace {

constexpr double kFarthest = 15.0;  // m, the end of the colour scale
constexpr int kScale = 3;           // picture px a pixel

/// What a log holds around one frame.
struct Recording {
  perception::PoseHistory poses;
  std::optional<perception::Frame> frame;
  std::optional<perception::Sweep> sweep;
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
      camera_image_t m;
      if (!Decode(*event, &m)) continue;
      if (!origin) origin = m.utime;
      perception::Frame frame = perception::FromMessage(m, *origin);
      if (!r.frame && frame.t >= at && frame.problem.empty()) r.frame = frame;
    } else if (event->channel == "POSE") {
      pose_t m;
      if (Decode(*event, &m) && origin && perception::Usable(m))
        r.poses.Add(perception::FromMessage(m, *origin));
    } else if (event->channel == "LIDAR_SCAN" && r.frame) {
      lidar_scan_t m;
      if (Decode(*event, &m)) r.sweep = perception::FromMessage(m, *origin);
    }
    if (r.frame && r.sweep && r.poses.At(r.frame->t, 0.0)) return r;
  }
  throw std::runtime_error(
      in + ": no CAMERA_IMAGE with LIDAR_SCAN and POSE after it; try an earlier --at");
}

void DrawPoint(const perception::Camera& camera, const Eigen::Vector3d& p_W, cv::Mat* picture) {
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

cv::Mat SweepPicture(const std::string& log, const world::Rig& rig, double at) {
  const Recording r = ReadAround(log, at);
  const perception::Camera camera = perception::CameraAt(*r.poses.At(r.frame->t, 0.0), rig);
  cv::Mat picture;
  cv::resize(r.frame->bgr, picture, {}, kScale, kScale, cv::INTER_NEAREST);
  for (size_t i = 0; i < r.sweep->points.size(); ++i) {
    const auto pose = r.poses.At(r.sweep->t + static_cast<double>(r.sweep->times[i]), 0.02);
    if (!pose) continue;
    const Eigen::Vector3d p_B = rig.lidar_position + rig.R_BL() * r.sweep->points[i].cast<double>();
    DrawPoint(camera, pose->p_WB + pose->R_WB * p_B, &picture);
  }
  return picture;
}

}  // namespace chase::calibrate
