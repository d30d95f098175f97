#include "services/perception/sight/network_detector.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>

#include "services/perception/sight/silhouette.h"

namespace chase::perception {

namespace {

constexpr float kSameBox = 0.45f;   // overlap above which two boxes are one
constexpr double kEdgeSigma = 2.5;  // px, standard deviation of a box's edge
constexpr int kBoxFields = 4;
constexpr float kMostScore = 1.001f;  // what is above is no score, as in a transposed output

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

[[noreturn]] void Refuse(const NetworkConfig& config, const std::string& why) {
  throw std::runtime_error("network.file '" + config.file + "' " + why);
}

std::string Sizes(const cv::Mat& m) {
  std::string text;
  for (int i = 0; i < m.dims; ++i) text += (i ? " x " : "") + std::to_string(m.size[i]);
  return text;
}

void CheckOutput(const NetworkConfig& config, const cv::Mat& out) {
  const std::string gives = "gives " + Sizes(out) + " numbers, ";
  if (out.dims != 3 || out.size[0] != 1 || out.size[2] <= kBoxFields || out.type() != CV_32F)
    Refuse(config, gives +
                       "needed is 1 x N x (4 + classes) of 32 bit: a row of centre x, centre y, "
                       "width, height and scores for each box; export it so");
  const int classes = out.size[2] - kBoxFields;
  if (config.class_id >= classes)
    Refuse(config, gives + "scores of " + std::to_string(classes) + " classes, but class_id is " +
                       std::to_string(config.class_id) + "; set network.class_id to 0 to " +
                       std::to_string(classes - 1));
  for (int i = 0; i < out.size[1]; ++i) {
    const float score = out.ptr<float>(0, i)[kBoxFields + config.class_id];
    if (std::isfinite(score) && score > kMostScore)
      Refuse(config, gives + "and with them a score of " + std::to_string(score) +
                         " on a blank image, needed are 0 to 1 in rows of 4 + classes; export it "
                         "so, transposed if its columns are the boxes");
  }
}

}  // namespace

NetworkDetector::NetworkDetector(const NetworkConfig& config, const world::Rig&) : config_(config) {
  try {
    net_ = cv::dnn::readNetFromONNX(config.file);
  } catch (const cv::Exception& e) {
    Refuse(config, "is not a readable ONNX network: " + e.err);
  }
  net_.setPreferableBackend(cv::dnn::DNN_BACKEND_OPENCV);
  net_.setPreferableTarget(cv::dnn::DNN_TARGET_CPU);
  const cv::Size size(config.input_width_px, config.input_height_px);
  try {
    CheckOutput(config, Forward(cv::Mat(size, CV_8UC3, cv::Scalar::all(0))));
  } catch (const cv::Exception& e) {
    Refuse(config, "does not take an image of " + std::to_string(size.width) + " x " +
                       std::to_string(size.height) + " px (" + e.err +
                       "); set network.input_width_px and network.input_height_px to what it was "
                       "made for");
  }
}

cv::Mat NetworkDetector::Forward(const cv::Mat& bgr) const {
  const cv::Size size(config_.input_width_px, config_.input_height_px);
  net_.setInput(cv::dnn::blobFromImage(bgr, 1.0 / 255.0, size, cv::Scalar(), true, false));
  return net_.forward();
}

/// Finite, and scored high enough.
bool NetworkDetector::Usable(const float* row) const {
  const float score = row[kBoxFields + config_.class_id];
  const auto finite = [](float x) { return std::isfinite(x); };
  return finite(score) && score >= config_.min_score && std::all_of(row, row + kBoxFields, finite);
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
  d.silhouette = FromBox(d.box, d.cut, kEdgeSigma);
  return d;
}

std::vector<Detection> NetworkDetector::Detect(const cv::Mat& bgr) const {
  const cv::Mat out = Forward(bgr);
  std::vector<Detection> all, kept;
  std::vector<cv::Rect2d> boxes;
  std::vector<float> scores;
  for (int i = 0; i < out.size[1]; ++i) {
    const float* row = out.ptr<float>(0, i);
    if (!Usable(row)) continue;
    const Detection d = Describe(row, bgr.size());
    if (d.box.area() <= 0.0) continue;
    all.push_back(d);
    boxes.push_back(d.box);
    scores.push_back(static_cast<float>(d.score));
  }
  std::vector<int> order;
  cv::dnn::NMSBoxes(boxes, scores, 0.0f, kSameBox, order);
  for (const int i : order) kept.push_back(all[static_cast<size_t>(i)]);
  return kept;
}

}  // namespace chase::perception
