#include "services/perception/messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "common/bus/convert.h"
#include "common/bus/image_format.h"

namespace chase::perception {

namespace {

/// Bytes of a pixel, 0 when the format is unknown.
int Channels(int32_t pixelformat) {
  if (pixelformat == camera_image_t::PIXEL_FORMAT_GRAY) return 1;
  const bool color = pixelformat == camera_image_t::PIXEL_FORMAT_RGB ||
                     pixelformat == camera_image_t::PIXEL_FORMAT_BGR;
  return color ? 3 : 0;
}

cv::Mat ToBgr(const cv::Mat& image, int32_t pixelformat) {
  cv::Mat bgr;
  if (pixelformat == camera_image_t::PIXEL_FORMAT_GRAY)
    cv::cvtColor(image, bgr, cv::COLOR_GRAY2BGR);
  else if (pixelformat == camera_image_t::PIXEL_FORMAT_RGB)
    cv::cvtColor(image, bgr, cv::COLOR_RGB2BGR);
  else
    image.copyTo(bgr);
  return bgr;
}

/// Why the target is not tracked; empty where it is.
std::string Reason(const TargetEstimate& target) {
  if (target.state == TargetState::kTracking) return "";
  if (!target.note.empty()) return target.note;
  if (target.state == TargetState::kSearching) return "no detection was taken for the target yet";
  return fmt::format("not seen for {:.1f} s", target.unseen);
}

// The wire counts the states in the same order.
static_assert(static_cast<int>(TargetState::kSearching) == target_t::SEARCHING &&
              static_cast<int>(TargetState::kTracking) == target_t::TRACKING &&
              static_cast<int>(TargetState::kOccluded) == target_t::OCCLUDED &&
              static_cast<int>(TargetState::kLost) == target_t::LOST);

}  // namespace

Frame FromMessage(const camera_image_t& m, int64_t origin) {
  Frame frame;
  frame.t = bus::Seconds(m.utime, origin);
  const int channels = Channels(m.pixelformat);
  if (m.pixelformat == bus::kPixelFormatMjpeg) {
    frame.bgr = cv::imdecode(m.data, cv::IMREAD_COLOR);
    if (frame.bgr.cols != m.width || frame.bgr.rows != m.height)
      frame.problem = "image is no JPEG of its width and height";
  } else if (channels == 0) {
    frame.problem = "pixel format " + std::to_string(m.pixelformat) + " is unknown";
  } else if (m.width <= 0 || m.height <= 0 || m.row_stride < channels * m.width ||
             static_cast<int64_t>(m.row_stride) * m.height > static_cast<int64_t>(m.data.size())) {
    frame.problem = "image is shorter than its width and height say";
  } else if (m.row_stride >= 2 * channels * m.width) {
    frame.problem = "image is not 8 bit";
  } else {
    const cv::Mat view(m.height, m.width, CV_8UC(channels), const_cast<uint8_t*>(m.data.data()),
                       static_cast<size_t>(m.row_stride));
    frame.bgr = ToBgr(view, m.pixelformat);
  }
  return frame;
}

Sweep FromMessage(const lidar_scan_t& m, int64_t origin) {
  Sweep sweep;
  sweep.t = bus::Seconds(m.utime, origin);
  sweep.points.reserve(m.x.size());
  sweep.times.reserve(m.x.size());
  for (size_t i = 0; i < m.x.size(); ++i) {
    const Eigen::Vector3f p(m.x[i], m.y[i], m.z[i]);
    if (!p.allFinite() || !std::isfinite(m.t[i])) continue;
    sweep.points.push_back(p);
    sweep.times.push_back(m.t[i]);
  }
  return sweep;
}

bool Usable(const pose_t& m) {
  return m.health == pose_t::HEALTH_OK || m.health == pose_t::HEALTH_DEGRADED;
}

PoseSample FromMessage(const pose_t& m, int64_t origin) {
  using Covariance = Eigen::Matrix<double, 9, 9, Eigen::RowMajor>;
  const Eigen::Map<const Covariance> C(m.local_covariance);
  PoseSample pose;
  pose.t = bus::Seconds(m.utime, origin);
  pose.p_WB = bus::ToVector(m.pos);
  pose.v_WB = bus::ToVector(m.vel);
  pose.a_WB = bus::ToVector(m.accel);
  pose.R_WB = bus::ToQuaternion(m.orientation).normalized();
  pose.w_WB_B = bus::ToVector(m.rotation_rate);
  pose.covariance << C.topLeftCorner<3, 3>(), C.topRightCorner<3, 3>(), C.bottomLeftCorner<3, 3>(),
      C.bottomRightCorner<3, 3>();
  return pose;
}

target_t ToMessage(const TargetEstimate& target, int64_t utime) {
  target_t m{};
  m.utime = utime;
  m.state = static_cast<int8_t>(target.state);
  bus::Set(m.mean, target.p_WT);
  bus::Set(m.covariance, target.covariance);
  bus::Set(m.velocity_covariance, target.velocity_covariance);
  bus::Set(m.velocity, target.v_WT);
  m.radius = target.size[0];
  m.height = target.size[1];
  const cv::Rect2d& b = target.box;
  const double box[4] = {b.x + 0.5 * b.width, b.y + 0.5 * b.height, b.width, b.height};
  std::copy(box, box + 4, m.box_px);
  m.score = target.score;
  m.n_points = target.n_points;
  m.existence = target.Existence();
  m.reason = Reason(target);
  return m;
}

selection_t ToMessage(const DetectorConfig& learned, int64_t utime) {
  selection_t m{};
  m.utime = utime;
  m.hue_min = learned.color.hue_min_deg;
  m.hue_max = learned.color.hue_max_deg;
  m.saturation_min = learned.color.saturation_min;
  m.value_min = learned.color.value_min;
  m.aspect = learned.shape.aspect;
  m.fill = learned.shape.fill;
  m.inset = learned.shape.inset;
  m.outline_sigma = learned.shape.outline_sigma;
  return m;
}

DetectorConfig FromMessage(const selection_t& m, DetectorConfig base) {
  base.kind = "color";
  base.color = {{}, m.hue_min, m.hue_max, m.saturation_min, m.value_min, false};
  base.shape = {{}, m.aspect, m.fill, m.inset, m.outline_sigma};
  return base;
}

}  // namespace chase::perception
