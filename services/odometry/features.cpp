#include "services/odometry/features.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

namespace chase::odometry {

namespace {

constexpr int kRings = 128;
constexpr float kLongestSweep = 0.2f;     // s
constexpr double kBetweenBeams = 0.0035;  // rad along a ring, about
constexpr int kLeastReturns = 4;          // of a post
constexpr float kGap = 0.018f;  // rad without a return: more than single ones that were lost
constexpr float kFlat = 0.9f;   // cosine of the flattest incidence of a wall whose end is used
constexpr float kLongestStep = 0.15f;    // m
constexpr float kStep = 0.3f;            // m in range, from a post to what is behind it
constexpr double kBetweenRings = 0.035;  // rad, of a sensor of 16 rings

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

  /// True when the surface breaks between points i-1 and i, or is seen at too flat an angle.
  bool Jump(int i) const {
    const float r = std::min(Range(i), Range(i - 1));
    return (p_[At(i)] - p_[At(i - 1)]).squaredNorm() > std::pow(0.08f + 0.035f * r, 2.0f);
  }

  /// The post whose returns are `first` to `last`; none where an outline is hidden by what stands
  /// before it, or where they are not those of something slim and round.
  std::optional<Post> PostOf(int first, int last) const {
    if (!StandsOut(first, first - 1) || !StandsOut(last, last + 1)) return std::nullopt;
    const int middle = (first + last) / 2, third = (last - first) / 3;
    const float step = static_cast<float>(kBetweenBeams) * Range(middle);
    const float width = (p_[At(last)] - p_[At(first)]).norm() + step;
    if (width > static_cast<float>(config_.post_width)) return std::nullopt;
    float front = 0.0f;
    for (int i = first + third; i <= last - third; ++i) front += Range(i);
    front /= static_cast<float>(last - first + 1 - 2 * third);
    for (int i : {first, last})
      if (std::abs(Range(i) - front) > 0.5f * width + kStep) return std::nullopt;
    const Eigen::Vector3f toward = p_[At(first)].normalized() + p_[At(last)].normalized();
    return Post{middle, toward.normalized() * (front + 0.5f * width) - p_[At(middle)]};
  }

  /// The end of a wall: where a run of `length` returns, straight over two windows, ends at `last`
  /// with `next` beyond it, about half a step behind its last return.
  std::optional<Post> EndOf(int last, int next, int length) const {
    const float beam = static_cast<float>(kBetweenBeams) * Range(last);
    const int k = 2 + static_cast<int>(2.0f * static_cast<float>(config_.window) / beam);
    const int inward = last < next ? -k : k;
    if (length <= 2 * k || !StandsOut(last, next)) return std::nullopt;
    const Eigen::Vector3f along = p_[At(last)] - p_[At(last + 2 * inward)];
    const Eigen::Vector3f unit = along.normalized();
    const Eigen::Vector3f bend = unit.cross(p_[At(last)] - p_[At(last + inward)]);
    const Eigen::Vector3f step = along / static_cast<float>(2 * k);
    if (bend.norm() > Limit(last) || step.norm() > kLongestStep ||
        std::abs(unit.dot(p_[At(last)].normalized())) > kFlat)
      return std::nullopt;
    return Post{last, 0.5f * step};
  }

  float Limit(int i) const {
    return static_cast<float>(config_.plane_deviation + config_.plane_deviation_ratio * Range(i));
  }

 private:
  static size_t At(int i) { return static_cast<size_t>(i); }

  /// True when nothing, or something farther, comes next to point i.
  bool StandsOut(int i, int next) const {
    const float turn = p_[At(i)].cross(p_[At(next)]).norm() / (Range(i) * Range(next));
    return turn > kGap || Range(next) > Range(i) + kStep;
  }

  const FeatureConfig& config_;
  int n_;
  float spacing_ = 0.0f;  // rad
  std::vector<Eigen::Vector3f> p_;
  std::vector<float> range_;
  std::vector<Eigen::Vector3d> sum_;
  std::vector<int> jumps_;  // number of jumps up to a point
};

/// Posts are runs of returns without a jump. The axis of a round one lies half its width behind its
/// front.
void AppendRing(const FeatureConfig& config, const std::vector<SweepPoint>& points,
                const std::vector<int>& order, FeatureSet* features) {
  const Ring ring(config, points, order);
  int first = 0;
  for (int i = 0; i < ring.size(); ++i) {
    const float bend = ring.Bend(i);
    if (bend >= 0.0f && bend < ring.Limit(i))
      features->planes.push_back(order[static_cast<size_t>(i)]);
    if (i == 0 || !ring.Jump(i)) continue;
    const int begin = std::exchange(first, i);
    if (begin == 0 || i - begin < kLeastReturns) continue;
    const auto add = [&](std::optional<Post> post) {
      if (!post) return false;
      post->point = order[static_cast<size_t>(post->point)];
      features->posts.push_back(*post);
      return true;
    };
    if (add(ring.PostOf(begin, i - 1))) continue;
    add(ring.EndOf(begin, begin - 1, i - begin));
    add(ring.EndOf(i - 1, i, i - begin));
  }
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
