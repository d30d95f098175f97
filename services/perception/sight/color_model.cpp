#include "services/perception/sight/color_model.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace chase::perception {

namespace {

constexpr double kHueSoftness = 6.0;                // degrees outside over which the score falls,
constexpr double kSoftness = 0.12;                  // and likewise of saturation and value
constexpr double kMinGain = 0.75, kMaxGain = 1.33;  // of a channel
constexpr int kBits = 6;
constexpr uint32_t kLevels = 1 << kBits;
// Pixels below tell the light's tint: earth, bark and concrete under a warm lamp reach 0.5.
constexpr double kGreySaturation = 0.6;
constexpr int kGreyMinimum = 200;  // sampled pixels needed for that
constexpr int kGreyStep = 4;       // every so many rows and columns are sampled
// Mean grey level below which it is the light that is dim, not what is seen: half of the 18 % grey
// that an exposure control aims at.
constexpr double kDim = 59.0;
constexpr double kDarkest = 0.05;  // share of the light at which a camera's noise hides all colour

/// How far `hue` lies outside the range, degrees; 0 inside. The range may wrap, and 0 to 360 is
/// all.
double HueOutside(double hue, double low, double high) {
  if (high - low >= 360.0) return 0.0;
  const double width = std::fmod(high - low + 360.0, 360.0);
  const double after = std::fmod(hue - low + 360.0, 360.0);
  return after <= width ? 0.0 : std::min(after - width, 360.0 - after);
}

/// 1 at or above the limit, falling to 0 over kSoftness below it.
double Ramp(double x, double limit) { return std::clamp(1.0 + (x - limit) / kSoftness, 0.0, 1.0); }

/// The share of daylight in an image, up to 1, from its mean brightness.
double Light(const cv::Mat& bgr) {
  const cv::Scalar mean = cv::mean(bgr);
  return std::clamp((mean[0] + mean[1] + mean[2]) / (3.0 * kDim), kDarkest, 1.0);
}

}  // namespace

Hsv ToHsv(double b, double g, double r) {
  const double high = std::max({b, g, r}), low = std::min({b, g, r}), span = high - low;
  if (span <= 0.0) return {0.0, 0.0, high};
  double hue = 0.0;
  if (high == r)
    hue = (g - b) / span;
  else if (high == g)
    hue = 2.0 + (b - r) / span;
  else
    hue = 4.0 + (r - g) / span;
  return {hue < 0.0 ? 60.0 * hue + 360.0 : 60.0 * hue, span / high, high};
}

double Score(const ColorConfig& config, const Hsv& c) {
  const double outside = HueOutside(c.hue_deg, config.hue_min_deg, config.hue_max_deg);
  return std::max(0.0, 1.0 - outside / kHueSoftness) * Ramp(c.saturation, config.saturation_min) *
         Ramp(c.value, config.value_min);
}

ColorModel::ColorModel(const ColorConfig& config) : config_(config) {
  table_.resize(static_cast<size_t>(kLevels) * kLevels * kLevels);
  const auto center = [](uint32_t level) { return (level + 0.5) / kLevels; };
  ColorConfig any = config;
  any.value_min = 0.0;
  size_t i = 0;
  for (uint32_t b = 0; b < kLevels; ++b)
    for (uint32_t g = 0; g < kLevels; ++g)
      for (uint32_t r = 0; r < kLevels; ++r)
        table_[i++] = static_cast<uint8_t>(std::lround(
            255.0 * chase::perception::Score(any, ToHsv(center(b), center(g), center(r)))));
}

Eigen::Vector3d ColorModel::Gains(const cv::Mat& bgr) const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  int count = 0;
  for (int y = 0; y < bgr.rows; y += kGreyStep)
    for (int x = 0; x < bgr.cols; x += kGreyStep) {
      const auto& p = bgr.at<cv::Vec3b>(y, x);
      const int high = std::max({p[0], p[1], p[2]}), low = std::min({p[0], p[1], p[2]});
      if (high < 30 || high > 250 || high - low > kGreySaturation * high) continue;
      sum += Eigen::Vector3d(p[0], p[1], p[2]);
      ++count;
    }
  if (count < kGreyMinimum) return Eigen::Vector3d::Ones();
  Eigen::Vector3d gains = sum.mean() * sum.cwiseInverse();
  // Warm light only: that is what makes earth and bark orange, while a large blue thing in view
  // would otherwise do the same.
  gains[0] = std::max(gains[0], 1.0);
  gains[2] = std::min(gains[2], 1.0);
  return gains.cwiseMax(kMinGain).cwiseMin(kMaxGain);
}

cv::Mat ColorModel::Score(const cv::Mat& bgr) const {
  const Eigen::Vector3d gains = config_.white_balance ? Gains(bgr) : Eigen::Vector3d::Ones();
  const double light = Light(bgr);
  const uint32_t usual = light > 0.5 ? 2 : light > 0.25 ? 1 : 0;  // bits less than 8 that tell
  std::array<std::array<uint32_t, 256>, 3> balanced;
  std::array<uint32_t, 256> value;  // score of the brightest channel
  for (size_t i = 0; i < 256; ++i) {
    for (size_t c = 0; c < 3; ++c)
      balanced[c][i] = static_cast<uint32_t>(
          std::min(255.0, static_cast<double>(i) * gains[static_cast<int>(c)]));
    const double level = ((static_cast<uint32_t>(i) >> usual) + 0.5) / (256 >> usual);
    value[i] = static_cast<uint32_t>(std::lround(255.0 * Ramp(level / light, config_.value_min)));
  }
  cv::Mat score(bgr.size(), CV_8U);
  for (int y = 0; y < bgr.rows; ++y) {
    const uint8_t* in = bgr.ptr<uint8_t>(y);
    uint8_t* out = score.ptr<uint8_t>(y);
    for (int x = 0; x < bgr.cols; ++x, in += 3) {
      const uint32_t b = balanced[0][in[0]], g = balanced[1][in[1]], r = balanced[2][in[2]];
      const uint32_t high = std::max({b, g, r});
      const uint32_t shift = std::max(usual, high < kLevels ? 0u : high < 2 * kLevels ? 1u : 2u);
      const uint32_t tint = table_[(((b >> shift) << kBits | g >> shift) << kBits) | r >> shift];
      out[x] = static_cast<uint8_t>(tint * value[high] / 255);
    }
  }
  return score;
}

}  // namespace chase::perception
