#include "services/mapping/panorama.h"

#include <algorithm>
#include <cmath>

namespace chase::mapping {

namespace {

constexpr int kNobody = -2;
constexpr double kInFront = 0.15;  // m, what is nearer by this hides
constexpr double kBeside = 0.15;   // m, half width of what must be clear for an edge to be one
constexpr double kStep = 0.012;    // rad, the same at least: some azimuth steps of the scanner

/// Monotone in the angle, 4 to the turn; between one and two thirds of an arc's length.
double Diamond(double x, double y) {
  const double s = std::abs(x) + std::abs(y);
  if (!(s > 0.0)) return 0.0;
  const double q = y / s;
  return x < 0.0 ? 2.0 - q : (y < 0.0 ? 4.0 + q : q);
}

}  // namespace

void Panorama::Take(const Eigen::Vector3d& origin, const std::vector<Return>& returns,
                    const std::vector<int>& owner) {
  origin_ = origin.head<2>();
  height_ = origin.z();
  bins_.assign(kBins, {INFINITY, INFINITY, 0.0f, kNobody});
  lowest_.assign(kBins * kBands, INFINITY);
  for (size_t i = 0; i < returns.size(); ++i) {
    const Return& r = returns[i];
    const Eigen::Vector2d d = r.p.head<2>().cast<double>() - origin_;
    const auto range = static_cast<float>(d.norm());
    const size_t b = static_cast<size_t>(0.25 * kBins * Diamond(d.x(), d.y())) % kBins;
    Bin& bin = bins_[b];
    bin.farthest = std::max(bin.farthest, range);
    const int band = static_cast<int>(std::min(range / static_cast<float>(kBand), kBands - 1.0f));
    float& lowest = lowest_[b * kBands + static_cast<size_t>(band)];
    lowest = std::min(lowest, (r.p.z() - static_cast<float>(height_)) / std::max(range, 1e-3f));
    if (r.label == Label::kGround || r.label == Label::kFar) continue;
    if (range < bin.first) {
      if (bin.owner != owner[i]) bin.second = bin.first;
      bin.first = range;
      bin.owner = owner[i];
    } else if (owner[i] != bin.owner && range < bin.second) {
      bin.second = range;
    }
  }
  for (size_t i = lowest_.size() - 1; i-- > 0;)
    if (i % kBands != kBands - 1) lowest_[i] = std::min(lowest_[i], lowest_[i + 1]);
}

template <class Check>
bool Panorama::Any(const Eigen::Vector2d& d, Check check) const {
  const int middle = static_cast<int>(0.25 * kBins * Diamond(d.x(), d.y()));
  const int reach =
      std::clamp(static_cast<int>(std::ceil(0.25 * kBins * std::max(kStep, kBeside / d.norm()))), 1,
                 kBins / 8);
  for (int b = middle - reach; b <= middle + reach; ++b)
    if (check(static_cast<size_t>((b + kBins) % kBins))) return true;
  return false;
}

bool Panorama::Hides(const Eigen::Vector2d& p, int owner) const {
  const Eigen::Vector2d d = p - origin_;
  const double range = d.norm();
  if (bins_.empty() || !(range > 0.0)) return false;
  return Any(d, [&](size_t b) {
    return (bins_[b].owner == owner ? bins_[b].second : bins_[b].first) < range - kInFront;
  });
}

bool Panorama::Sees(const Eigen::Vector2d& p, double z) const {
  const Eigen::Vector2d d = p - origin_;
  const double range = d.norm();
  if (bins_.empty()) return true;
  const auto beyond = static_cast<size_t>(range / kBand) + 1;
  if (!(range > 0.0) || beyond >= kBands) return false;
  return !Any(d, [&](size_t b) { return bins_[b].first < range - kInFront; }) &&
         Any(d, [&](size_t b) {
           return bins_[b].farthest > range && height_ + lowest_[b * kBands + beyond] * range <= z;
         });
}

}  // namespace chase::mapping
