#include "services/perception/sight/marker_detector.h"

#include <map>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>

#include "services/perception/sight/silhouette.h"

namespace chase::perception {

namespace {

constexpr double kCornerSigma = 0.5;  // px, standard deviation of a corner

int DictionaryByName(const std::string& name) {
  static const std::map<std::string, int> kNames = {
      {"DICT_4X4_50", cv::aruco::DICT_4X4_50},
      {"DICT_5X5_50", cv::aruco::DICT_5X5_50},
      {"DICT_6X6_250", cv::aruco::DICT_6X6_250},
      {"DICT_ARUCO_ORIGINAL", cv::aruco::DICT_ARUCO_ORIGINAL},
      {"DICT_APRILTAG_16h5", cv::aruco::DICT_APRILTAG_16h5},
      {"DICT_APRILTAG_25h9", cv::aruco::DICT_APRILTAG_25h9},
      {"DICT_APRILTAG_36h11", cv::aruco::DICT_APRILTAG_36h11}};
  const auto found = kNames.find(name);
  if (found != kNames.end()) return found->second;
  std::string known;
  for (const auto& [key, value] : kNames) known += " " + key;
  throw std::runtime_error("marker.dictionary '" + name + "' is unknown; known are" + known);
}

void CheckId(const MarkerConfig& config, const cv::aruco::Dictionary& dictionary) {
  const int count = dictionary.bytesList.rows;
  if (config.id < count) return;
  throw std::runtime_error("marker.id is " + std::to_string(config.id) + ", must be 0 to " +
                           std::to_string(count - 1) + " in " + config.dictionary +
                           ", or -1 for any; set it so, or another marker.dictionary");
}

/// Covariance along a line of sight n (unit, frame C): `along` [m] on it, `across` [m] beside it.
Eigen::Matrix3d SightCovariance(const Eigen::Vector3d& n, double along, double across) {
  return across * across * Eigen::Matrix3d::Identity() +
         (along * along - across * across) * n * n.transpose();
}

}  // namespace

MarkerDetector::MarkerDetector(const MarkerConfig& config, const world::Rig& rig)
    : config_(config),
      rig_(rig),
      dictionary_(cv::aruco::getPredefinedDictionary(DictionaryByName(config.dictionary))),
      parameters_(cv::aruco::DetectorParameters::create()) {
  CheckId(config, *dictionary_);
  parameters_->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
  parameters_->cornerRefinementWinSize = 3;
  parameters_->minMarkerPerimeterRate = 0.04;
}

Detection MarkerDetector::Describe(const std::vector<cv::Point2f>& corners) const {
  const auto half = static_cast<float>(0.5 * config_.side);
  const std::vector<cv::Point3f> square = {
      {-half, half, 0}, {half, half, 0}, {half, -half, 0}, {-half, -half, 0}};
  std::vector<cv::Point2d> seen;  // as a pinhole shows them at distance 1
  for (const auto& px : corners) {
    const Eigen::Vector3d ray = rig_.Ray({px.x, px.y});
    seen.emplace_back(ray.x(), ray.y());
  }
  cv::Vec3d rotation, translation;
  Detection d;
  const cv::Rect2f box = cv::boundingRect(corners);
  d.box = cv::Rect2d(box.x, box.y, box.width, box.height);
  d.score = 1.0;
  if (!cv::solvePnP(square, seen, cv::Matx33d::eye(), cv::noArray(), rotation, translation, false,
                    cv::SOLVEPNP_IPPE_SQUARE))
    return d;
  const Eigen::Vector3d marker(translation[0], translation[1], translation[2]);
  const double range = marker.norm();
  const Eigen::Vector3d sight = marker / range;
  const double across = kCornerSigma * range / rig_.focal_px;
  d.p_CT = marker + config_.depth * sight;
  // Range from the apparent edge; the marker may also be seen at an angle, so that its target's
  // centre does not lie exactly behind it.
  d.p_CT_covariance = SightCovariance(sight, across * range / config_.side + 0.01,
                                      across + 0.25 * std::abs(config_.depth));
  return d;
}

std::vector<Detection> MarkerDetector::Detect(const cv::Mat& bgr) const {
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(bgr, dictionary_, corners, ids, parameters_);
  std::vector<Detection> found;
  for (size_t i = 0; i < ids.size(); ++i)
    if (config_.id < 0 || ids[i] == config_.id) found.push_back(Describe(corners[i]));
  return found;
}

}  // namespace chase::perception
