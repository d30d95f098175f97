#include "services/perception/place/search_boxes.h"

#include <algorithm>
#include <cmath>

#include "services/perception/sight/silhouette.h"

namespace chase::perception {

namespace {

constexpr double kBoxMargin = 0.25;  // share of the expected box in which a piece may lie
constexpr double kLarger = 1.1;      // times the expected size: more than the target
constexpr double kGateSigmas = 3.0;

cv::Rect2d Grown(const cv::Rect2d& box, double dx, double dy) {
  return {box.x - dx, box.y - dy, box.width + 2 * dx, box.height + 2 * dy};
}

}  // namespace

std::optional<SearchBoxes> WhereToLook(const TargetGaussian& thing, const TargetShape& shape,
                                       const Camera& camera, double tilt) {
  const auto box = ProjectTarget(camera, thing.position(), shape);
  if (!box) return std::nullopt;
  const double range = (thing.position() - camera.p_WC).norm();
  const double sigma = std::sqrt(thing.covariance.topLeftCorner<3, 3>().diagonal().maxCoeff());
  const double px = camera.PixelsPerRadian({box->x + 0.5 * box->width, box->y + 0.5 * box->height});
  const double spread = kGateSigmas * sigma / range * px, tilted = kGateSigmas * tilt * px;
  const double margin = tilted + spread, trim = 0.5 * tilted + spread;
  return SearchBoxes{
      *box, Grown(*box, margin + kBoxMargin * box->width, margin + kBoxMargin * box->height),
      Grown(*box, trim, trim)};
}

std::optional<Detection> Within(const SearchBoxes& boxes, const cv::Mat& bgr,
                                const Detection& detection) {
  const double more = 4.0 * detection.silhouette.sigma_px;
  const bool larger = detection.box.width > kLarger * boxes.expected.width + more ||
                      detection.box.height > kLarger * boxes.expected.height + more;
  if (detection.mask.empty() || !larger) return detection;
  const cv::Rect2d& trim = boxes.trim;
  const cv::Rect window(static_cast<int>(std::floor(trim.x)), static_cast<int>(std::floor(trim.y)),
                        static_cast<int>(std::ceil(trim.width)),
                        static_cast<int>(std::ceil(trim.height)));
  return CropTo(bgr, detection, window);
}

double Likeness(const cv::Rect2d& box, const SearchBoxes& boxes) {
  const auto alike = [](double a, double b) { return std::min(a, b) / std::max({a, b, 1.0}); };
  const auto beside = [](double a, double width, double b, double wanted, double reach) {
    return std::abs(a + 0.5 * width - b - 0.5 * wanted) / std::max(1.0, reach);
  };
  const cv::Rect2d &e = boxes.expected, &s = boxes.search;
  const double off = std::hypot(beside(box.x, box.width, e.x, e.width, s.width),
                                beside(box.y, box.height, e.y, e.height, s.height));
  return alike(box.width, e.width) * alike(box.height, e.height) / (1.0 + off);
}

double Prominence(const Detection& detection, const world::Rig& rig) {
  const auto& box = detection.box;
  const double aside = (box.x + 0.5 * box.width - rig.center_u_px) / (0.5 * rig.width_px);
  return box.height * std::exp(-aside * aside);
}

}  // namespace chase::perception
