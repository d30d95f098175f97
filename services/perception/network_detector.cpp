#include "services/perception/network_detector.h"

#include <algorithm>
#include <stdexcept>

#include "services/perception/silhouette.h"

namespace chase::perception {

namespace {

constexpr int kBoxFields = 4;

/// The middle of each side that is not cut, as one sample with the box's own accuracy.
Silhouette FromBox(const cv::Rect2d& box, const std::array<bool, 4>& cut, double sigma_px) {
  const double u = box.x + 0.5 * box.width, v = box.y + 0.5 * box.height;
  Silhouette s;
  s.sigma_px = sigma_px;
  if (!cut[kLeft]) s.samples[kLeft].emplace_back(box.x, v);
  if (!cut[kRight]) s.samples[kRight].emplace_back(box.x + box.width, v);
  if (!cut[kTop]) s.samples[kTop].emplace_back(u, box.y);
  if (!cut[kBottom]) s.samples[kBottom].emplace_back(u, box.y + box.height);
  return s;
}

double Overlap(const cv::Rect2d& a, const cv::Rect2d& b) {
  const double both = (a & b).area();
  return both / std::max(1e-9, a.area() + b.area() - both);
}

}  // namespace

NetworkDetector::NetworkDetector(const NetworkConfig& config, const world::Rig&) : config_(config) {
  try {
    net_ = cv::dnn::readNetFromONNX(config.file);
  } catch (const cv::Exception& e) {
    throw std::runtime_error("network.file '" + config.file +
                             "' is not a readable ONNX network: " + e.err);
  }
  net_.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
  net_.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
}

Detection NetworkDetector::Describe(const float* row, const cv::Size& image) const {
  const double sx = static_cast<double>(image.width) / config_.input_width_px;
  const double sy = static_cast<double>(image.height) / config_.input_height_px;
  const cv::Rect2d whole(0, 0, image.width, image.height);
  const double w = row[2] * sx, h = row[3] * sy;
  Detection d;
  d.box = cv::Rect2d(row[0] * sx - 0.5 * w, row[1] * sy - 0.5 * h, w, h) & whole;
  d.score = row[kBoxFields + config_.class_id];
  const cv::Rect roi(static_cast<int>(d.box.x), static_cast<int>(d.box.y),
                     static_cast<int>(d.box.width + 0.999), static_cast<int>(d.box.height + 0.999));
  d.cut = CutSides(roi, image);
  d.box -= cv::Point2d(0.5, 0.5);  // from pixel corners to pixel centres
  d.silhouette = FromBox(d.box, d.cut, config_.edge_sigma_px);
  return d;
}

std::vector<Detection> NetworkDetector::Detect(const cv::Mat& bgr) const {
  const cv::Size size(config_.input_width_px, config_.input_height_px);
  net_.setInput(cv::dnn::blobFromImage(bgr, 1.0 / 255.0, size, cv::Scalar(), true, false));
  const cv::Mat out = net_.forward();
  if (out.dims != 3 || out.size[2] <= kBoxFields + config_.class_id) return {};
  std::vector<Detection> all, kept;
  for (int i = 0; i < out.size[1]; ++i) {
    const float* row = out.ptr<float>(0, i);
    if (row[kBoxFields + config_.class_id] >= config_.min_score)
      all.push_back(Describe(row, bgr.size()));
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const Detection& a, const Detection& b) { return a.score > b.score; });
  for (const auto& d : all) {
    const auto same = [&](const Detection& k) { return Overlap(k.box, d.box) > config_.overlap; };
    if (d.box.area() > 0.0 && std::none_of(kept.begin(), kept.end(), same)) kept.push_back(d);
  }
  return kept;
}

}  // namespace chase::perception
