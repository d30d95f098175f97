#include "services/mapping/panorama.h"

#include <algorithm>
#include <cmath>

namespace chase::mapping {

namespace {

constexpr int kNobody = -2;        // nothing, or what is too near for a return
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

/// The unit direction of that.
Eigen::Vector2d FromDiamond(double q) {
  const double x = q < 2.0 ? 1.0 - q : q - 3.0, y = q < 1.0 ? q : (q < 3.0 ? 2.0 - q : q - 4.0);
  return Eigen::Vector2d(x, y).normalized();
}

}  // namespace

bool LowestRays::MeetGround(const Eigen::Vector2d& d) const {
  const double tilt = std::atan2(-d.dot(axis.head<2>()), axis.z());  // of that plane towards d
  return std::tan(elevation + tilt) * range < -height;
}

void Panorama::Take(const Eigen::Vector3d& origin, const LowestRays& rays,
                    const std::vector<Return>& returns, const std::vector<int>& owner) {
  origin_ = origin.head<2>();
  height_ = origin.z();
  bins_.assign(kBins * kRises, {INFINITY, INFINITY, kNobody});
  farthest_.assign(kBins, 0.0f);
  lowest_.assign(kBins * kBands, INFINITY);
  for (size_t i = 0; i < returns.size(); ++i) {
    const Return& r = returns[i];
    const Eigen::Vector2d d = r.p.head<2>().cast<double>() - origin_;
    const auto range = static_cast<float>(d.norm());
    const size_t b = static_cast<size_t>(0.25 * kBins * Diamond(d.x(), d.y())) % kBins;
    const float slope = (r.p.z() - static_cast<float>(height_)) / std::max(range, 1e-3f);
    farthest_[b] = std::max(farthest_[b], range);
    const int band = static_cast<int>(std::min(range / static_cast<float>(kBand), kBands - 1.0f));
    float& lowest = lowest_[b * kBands + static_cast<size_t>(band)];
    lowest = std::min(lowest, slope);
    if (r.label == Label::kGround || r.label == Label::kFar) continue;
    Bin& bin = bins_[b * kRises + static_cast<size_t>(Rise(slope))];
    if (range < bin.first) {
      if (bin.owner != owner[i]) bin.second = bin.first;
      bin.first = range;
      bin.owner = owner[i];
    } else if (owner[i] != bin.owner && range < bin.second) {
      bin.second = range;
    }
  }
  const auto empty = [this](size_t b) { return !(farthest_[b % kBins] > 0.0f); };
  for (size_t b = 0; b < kBins; ++b)
    if (empty(b + kBins - 1) && empty(b) && empty(b + 1) &&
        rays.MeetGround(FromDiamond(4.0 * (static_cast<double>(b) + 0.5) / kBins)))
      std::fill_n(&bins_[b * kRises], kRises, Bin{0.0f, 0.0f, kNobody});
  for (size_t i = lowest_.size() - 1; i-- > 0;)
    if (i % kBands != kBands - 1) lowest_[i] = std::min(lowest_[i], lowest_[i + 1]);
}

int Panorama::Rise(double slope) {
  return static_cast<int>(std::clamp(slope / kRise + 0.5 * kRises, 0.0, kRises - 1.0));
}

template <class Check>
bool Panorama::Any(const Eigen::Vector2d& d, double beside, Check check) {
  const int middle = static_cast<int>(0.25 * kBins * Diamond(d.x(), d.y()));
  const int reach = std::clamp(
      static_cast<int>(std::ceil(0.25 * kBins * std::max(kStep, beside / d.norm()))), 1, kBins / 8);
  for (int b = middle - reach; b <= middle + reach; ++b)
    if (check(static_cast<size_t>((b + kBins) % kBins))) return true;
  return false;
}

bool Panorama::Hides(const Eigen::Vector3d& p, int owner, double depth) const {
  const Eigen::Vector2d d = p.head<2>() - origin_;
  const double range = d.norm();
  if (bins_.empty() || !(range > 0.0)) return false;
  const auto rise = static_cast<size_t>(Rise((p.z() - height_) / range));
  return Any(d, kBeside, [&](size_t b) {
    const Bin& bin = bins_[b * kRises + rise];
    return (bin.owner == owner ? bin.second : bin.first) < range - depth - kInFront;
  });
}

bool Panorama::Sees(const Eigen::Vector3d& p, double depth) const {
  const Eigen::Vector2d d = p.head<2>() - origin_;
  const double range = d.norm(), front = range - depth;
  if (bins_.empty()) return true;
  const auto beyond = static_cast<size_t>(std::max(0.0, front) / kBand) + 1;
  if (!(front > 0.0) || beyond >= kBands || Hides(p, kNobody, depth)) return false;
  return Any(d, 0.0, [&](size_t b) {
    return farthest_[b] > front && height_ + lowest_[b * kBands + beyond] * range <= p.z();
  });
}

}  // namespace chase::mapping
