#include "services/camera/image.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace chase::camera {
namespace {

cv::Mat EightBit(const cv::Mat& frame) {
  if (frame.depth() != CV_16U) return frame;
  cv::Mat out;
  frame.convertTo(out, CV_8U, 1.0 / 257.0);
  return out;
}

cv::Mat Coloured(const cv::Mat& frame) {
  cv::Mat out;
  switch (frame.channels()) {
    case 1:
      cv::cvtColor(frame, out, cv::COLOR_GRAY2RGB);
      break;
    case 3:
      cv::cvtColor(frame, out, cv::COLOR_BGR2RGB);
      break;
    case 4:
      cv::cvtColor(frame, out, cv::COLOR_BGRA2RGB);
      break;
    default:
      break;
  }
  return out;
}

/// The largest centred part of the frame with the aspect ratio width : height.
cv::Mat Centred(const cv::Mat& frame, int width, int height) {
  const double scale =
      std::min(static_cast<double>(frame.cols) / width, static_cast<double>(frame.rows) / height);
  const int w = std::clamp(static_cast<int>(std::lround(scale * width)), 1, frame.cols);
  const int h = std::clamp(static_cast<int>(std::lround(scale * height)), 1, frame.rows);
  return frame(cv::Rect((frame.cols - w) / 2, (frame.rows - h) / 2, w, h));
}

}  // namespace

cv::Mat ToRgb(const cv::Mat& frame, int width_px, int height_px) {
  if (frame.empty() || (frame.depth() != CV_8U && frame.depth() != CV_16U)) return {};
  const cv::Mat rgb = Coloured(EightBit(frame));
  if (rgb.empty() || width_px == 0 || rgb.size() == cv::Size(width_px, height_px)) return rgb;
  cv::Mat out;
  cv::resize(Centred(rgb, width_px, height_px), out, {width_px, height_px}, 0, 0, cv::INTER_AREA);
  return out;
}

std::vector<uint8_t> ToJpeg(const cv::Mat& rgb, int quality, std::size_t most_bytes) {
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  std::vector<uint8_t> jpeg;
  for (; quality > 0; quality /= 2) {
    cv::imencode(".jpg", bgr, jpeg, {cv::IMWRITE_JPEG_QUALITY, quality});
    if (jpeg.size() <= most_bytes) return jpeg;
  }
  return {};
}

}  // namespace chase::camera
