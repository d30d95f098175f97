#include "services/perception/sight/detector.h"

#include "services/perception/sight/color_detector.h"
#include "services/perception/sight/marker_detector.h"
#include "services/perception/sight/network_detector.h"

namespace chase::perception {

bool Detection::LargerThan(const cv::Rect2d& expected) const {
  constexpr double kLarger = 1.1, kSigmas = 4.0;  // times its size, and of an edge more
  const double more = kSigmas * silhouette.sigma_px;
  return box.width > kLarger * expected.width + more ||
         box.height > kLarger * expected.height + more;
}

std::unique_ptr<Detector> MakeDetector(const DetectorConfig& config, double edge_sigma_px,
                                       const world::Rig& rig) {
  if (config.kind == "marker") return std::make_unique<MarkerDetector>(config.marker, rig);
  if (config.kind == "network") return std::make_unique<NetworkDetector>(config.network, rig);
  return std::make_unique<ColorDetector>(config, edge_sigma_px);
}

}  // namespace chase::perception
