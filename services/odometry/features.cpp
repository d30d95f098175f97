#include "services/odometry/features.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace chase::odometry {

namespace {

constexpr int kRings = 128;
constexpr int kSectors = 6;
constexpr float kLongestSweep = 0.2f;     // s
constexpr double kBetweenBeams = 0.0035;  // rad along a ring, about
constexpr double kBetweenRings = 0.035;   // rad, of a sensor of 16 rings

bool Usable(const FeatureConfig& config, const SweepPoint& point) {
  const double r2 = point.p.cast<double>().squaredNorm();  // finite where the point is
  return std::isfinite(r2) && r2 >= config.min_range * config.min_range &&
         r2 <= config.max_range * config.max_range && point.t >= 0.0f && point.t <= kLongestSweep &&
         point.ring < kRings;
}

/// The indices of each ring's points in the order of firing.
std::array<std::vector<int>, kRings> SplitByRing(const std::vector<SweepPoint>& points) {
  std::array<std::vector<int>, kRings> rings;
  for (int i = 0; i < static_cast<int>(points.size()); ++i)
    rings[points[static_cast<size_t>(i)].ring].push_back(i);
  const auto earlier = [&](int a, int b) {
    return points[static_cast<size_t>(a)].t < points[static_cast<size_t>(b)].t;
  };
  for (auto& ring : rings)
    if (!std::is_sorted(ring.begin(), ring.end(), earlier))
      std::stable_sort(ring.begin(), ring.end(), earlier);
  return rings;
}

/// One ring, with running sums so that a window's mean costs the same at any length.
class Ring {
 public:
  Ring(const FeatureConfig& config, const std::vector<SweepPoint>& points,
       const std::vector<int>& order)
      : config_(config), n_(static_cast<int>(order.size())) {
    p_.reserve(order.size());
    range_.reserve(order.size());
    sum_.reserve(order.size() + 1);
    sum_.push_back(Eigen::Vector3d::Zero());
    for (int i : order) {
      p_.push_back(points[static_cast<size_t>(i)].p);
      range_.push_back(p_.back().norm());
      sum_.push_back(sum_.back() + p_.back().cast<double>());
    }
    jumps_.assign(order.size() + 1, 0);
    for (int i = 1; i < n_; ++i) jumps_[At(i) + 1] = jumps_[At(i)] + (Jump(i) ? 1 : 0);
    if (n_ > 0) spacing_ = 2.0f * static_cast<float>(M_PI) / static_cast<float>(std::max(n_, 600));
  }

  int size() const { return n_; }

  /// Half length of the window round point i, in points.
  int HalfWindow(int i) const {
    const float step = std::max(1e-4f, Range(i) * spacing_);
    return std::clamp(static_cast<int>(static_cast<float>(config_.window) / step), 2, 12);
  }

  /// How far point i stands off the middle of its window, perpendicular to the ring [m]; negative
  /// where the window leaves the ring or a jump lies in it.
  float Bend(int i) const {
    const int k = HalfWindow(i);
    if (i < k || i + k >= n_ || jumps_[At(i + k) + 1] != jumps_[At(i - k) + 1]) return -1.0f;
    const Eigen::Vector3d sum = sum_[At(i + k) + 1] - sum_[At(i - k)];
    const Eigen::Vector3f mean = (sum / (2 * k + 1)).cast<float>();
    const Eigen::Vector3f along = p_[At(i + k)] - p_[At(i - k)];
    const float length2 = along.squaredNorm();
    if (length2 < 1e-8f) return -1.0f;
    const Eigen::Vector3f d = p_[At(i)] - mean;
    return (d - along * (along.dot(d) / length2)).norm();
  }

  float Range(int i) const { return range_[At(i)]; }

 private:
  static size_t At(int i) { return static_cast<size_t>(i); }
  /// True when the surface breaks between points i-1 and i, or is seen at too flat an angle.
  bool Jump(int i) const {
    const float r = std::min(Range(i), Range(i - 1));
    return (p_[At(i)] - p_[At(i - 1)]).squaredNorm() > std::pow(0.08f + 0.035f * r, 2.0f);
  }

  const FeatureConfig& config_;
  int n_;
  float spacing_ = 0.0f;  // rad
  std::vector<Eigen::Vector3f> p_;
  std::vector<float> range_;
  std::vector<Eigen::Vector3d> sum_;
  std::vector<int> jumps_;  // number of jumps up to a point
};

/// Appends the sharpest points of a sector, no two of them within five points of each other.
void AppendEdges(const FeatureConfig& config, const std::vector<float>& bend,
                 const std::vector<int>& order, int begin, int end, std::vector<int>* edges) {
  std::vector<int> candidates;
  for (int i = begin; i < end; ++i)
    if (bend[static_cast<size_t>(i)] > config.edge_deviation) candidates.push_back(i);
  std::stable_sort(candidates.begin(), candidates.end(), [&](int a, int b) {
    return bend[static_cast<size_t>(a)] > bend[static_cast<size_t>(b)];
  });
  std::vector<int> chosen;
  for (int i : candidates) {
    if (static_cast<int>(chosen.size()) >= config.edges_per_sector) break;
    const bool near = std::any_of(chosen.begin(), chosen.end(),
                                  [i](int other) { return std::abs(i - other) <= 5; });
    if (!near) chosen.push_back(i);
  }
  for (int i : chosen) edges->push_back(order[static_cast<size_t>(i)]);
}

void AppendRing(const FeatureConfig& config, const std::vector<SweepPoint>& points,
                const std::vector<int>& order, FeatureSet* features) {
  const Ring ring(config, points, order);
  std::vector<float> bend(order.size(), -1.0f);
  for (int i = 0; i < ring.size(); ++i) {
    const float b = bend[static_cast<size_t>(i)] = ring.Bend(i);
    const double limit = config.plane_deviation + config.plane_deviation_ratio * ring.Range(i);
    if (b >= 0.0f && b < limit) features->planes.push_back(order[static_cast<size_t>(i)]);
  }
  for (int s = 0; s < kSectors; ++s)
    AppendEdges(config, bend, order, ring.size() * s / kSectors, ring.size() * (s + 1) / kSectors,
                &features->edges);
}

}  // namespace

void RemoveUnusable(const FeatureConfig& config, std::vector<SweepPoint>* points) {
  points->erase(std::remove_if(points->begin(), points->end(),
                               [&](const SweepPoint& point) { return !Usable(config, point); }),
                points->end());
}

FeatureSet ExtractFeatures(const FeatureConfig& config, const std::vector<SweepPoint>& points) {
  FeatureSet features;
  features.planes.reserve(points.size());
  for (const auto& order : SplitByRing(points))
    if (!order.empty()) AppendRing(config, points, order, &features);
  return features;
}

std::vector<int> Thinning::Evenly(const std::vector<SweepPoint>& points,
                                  const std::vector<int>& indices, int wanted) {
  std::vector<int> kept;
  double due = 0.0;
  for (int i : indices) {
    const double r = static_cast<double>(points[static_cast<size_t>(i)].p.norm()) / size_;
    due += std::min(1.0, kBetweenBeams * r) * std::min(1.0, kBetweenRings * r);
    if (due < 1.0) continue;
    due -= 1.0;
    kept.push_back(i);
  }
  const double ratio = static_cast<double>(kept.size()) / wanted;
  size_ = std::clamp(size_ * std::sqrt(std::clamp(ratio, 0.5, 2.0)), 0.001, 3.0);
  return kept;
}

}  // namespace chase::odometry
