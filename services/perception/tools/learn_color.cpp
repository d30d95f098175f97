#include "services/perception/tools/learn_color.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "services/perception/sight/color_model.h"

namespace chase::perception {

namespace {

constexpr double kTail = 0.03;       // share of the pixels beyond either limit: marking errors
constexpr double kOtherLight = 3.0;  // degrees, what the hue shifts by in light not yet seen: sweep
constexpr double kShade = 0.5;       // brightness in shade, share of the darkest one learned
constexpr double kGlare = 0.8;       // saturation in glare, share of the palest one learned: sweep
constexpr double kAccepted = 0.5;    // score of a pixel that the detector takes
constexpr double kBorder = 0.35;     // of the mask's lesser extent: masks are drawn inside outlines
constexpr double kWorthIt = 0.5;     // of a picture's index, gained by leaving one out: sweep
constexpr size_t kSamples = 1000;    // of a picture and kind: 1 % standard deviation of a share

/// Colours of one picture.
struct Samples {
  std::vector<Hsv> target, near, far;
  double near_ratio, far_ratio;  ///< pixels of the background over those of the target
};

/// Colours of kSamples of the pixels, some of them more than once where there are fewer.
std::vector<Hsv> Pick(const cv::Mat& bgr, const cv::Mat& where) {
  std::vector<cv::Point> at;
  cv::findNonZero(where, at);
  std::vector<Hsv> picked;
  for (size_t i = 0; i < kSamples && !at.empty(); ++i) {
    const auto& p = bgr.at<cv::Vec3b>(at[i * at.size() / kSamples]);
    picked.push_back(ToHsv(p[0] / 255.0, p[1] / 255.0, p[2] / 255.0));
  }
  return picked;
}

Samples SamplesOf(const cv::Mat& bgr, const cv::Mat& mask) {
  const cv::Rect box = cv::boundingRect(mask);
  const int border = static_cast<int>(kBorder * std::min(box.width, box.height));
  const cv::Mat square = cv::Mat::ones(2 * border + 1, 2 * border + 1, CV_8U);
  cv::Mat grown, near = cv::Mat::zeros(mask.size(), CV_8U);
  cv::dilate(mask, grown, square);
  const cv::Rect window(box.tl() - cv::Point(box.width, box.height),
                        cv::Size(3 * box.width, 3 * box.height));
  near(window & cv::Rect({}, mask.size())).setTo(255);
  const cv::Mat far = grown == 0;
  near &= far;
  const double n = cv::countNonZero(mask);
  return {Pick(bgr, mask), Pick(bgr, near), Pick(bgr, far), cv::countNonZero(near) / n,
          cv::countNonZero(far) / n};
}

double Share(const ColorConfig& range, const std::vector<Hsv>& of) {
  const auto n = std::count_if(of.begin(), of.end(),
                               [&](const Hsv& c) { return Score(range, c) >= kAccepted; });
  return static_cast<double>(n) / static_cast<double>(std::max<size_t>(1, of.size()));
}

/// Circular mean of the hues, degrees. What is grey or dark has no hue: each weighs by its chroma.
double MeanHue(const std::vector<Hsv>& colors) {
  double x = 0.0, y = 0.0;
  for (const auto& c : colors) {
    x += c.saturation * c.value * std::cos(c.hue_deg * M_PI / 180.0);
    y += c.saturation * c.value * std::sin(c.hue_deg * M_PI / 180.0);
  }
  return std::atan2(y, x) * 180.0 / M_PI;
}

ColorConfig RangeOf(const std::vector<Samples>& all, const std::vector<bool>& used,
                    const ColorConfig& base) {
  std::vector<Hsv> colors;
  for (size_t i = 0; i < all.size(); ++i)
    if (used[i]) colors.insert(colors.end(), all[i].target.begin(), all[i].target.end());
  /// The value that `share` of the colours do not exceed.
  const auto percentile = [&](double share, const auto& value_of) {
    std::vector<double> values;
    for (const auto& c : colors) values.push_back(value_of(c));
    const auto at = values.begin() + std::lround(share * static_cast<double>(values.size() - 1));
    std::nth_element(values.begin(), at, values.end());
    return *at;
  };
  const double middle = MeanHue(colors);
  const auto off = [&](const Hsv& c) { return std::remainder(c.hue_deg - middle, 360.0); };
  const double low = percentile(kTail, off) - kOtherLight;
  const double high = percentile(1.0 - kTail, off) + kOtherLight;
  ColorConfig config = base;
  config.hue_min_deg = std::fmod(middle + low + 720.0, 360.0);
  config.hue_max_deg = std::fmod(middle + high + 720.0, 360.0);
  if (high - low >= 360.0) config.hue_min_deg = 0.0, config.hue_max_deg = 360.0;
  config.saturation_min = kGlare * percentile(kTail, [](const Hsv& c) { return c.saturation; });
  config.value_min = kShade * percentile(kTail, [](const Hsv& c) { return c.value; });
  return config;
}

std::vector<Separation> Separations(const std::vector<Samples>& all, const ColorConfig& range) {
  std::vector<Separation> out;
  for (const auto& s : all) {
    out.emplace_back();
    out.back().target = Share(range, s.target);
    out.back().near = Share(range, s.near);
    out.back().far = Share(range, s.far);
    out.back().index = out.back().target / (1.0 + out.back().near * s.near_ratio) /
                       (1.0 + out.back().far * s.far_ratio);
  }
  return out;
}

/// The pictures to learn from: as long as the others separate all pictures better without one, the
/// worst such one goes. What a picture can lose or win is bounded by 1.
std::vector<bool> Consensus(const std::vector<Samples>& all, const ColorConfig& base) {
  std::vector<bool> used(all.size(), true);
  const auto quality = [&] {
    double sum = 0.0;
    for (const auto& s : Separations(all, RangeOf(all, used, base))) sum += s.index;
    return sum;
  };
  double best = quality();
  for (size_t left = all.size(); left > 1; --left) {
    std::optional<size_t> worst;
    for (size_t i = 0; i < all.size(); ++i) {
      if (!used[i]) continue;
      used[i] = false;
      const double without = quality();
      used[i] = true;
      if (without <= (worst ? best : best + kWorthIt)) continue;
      best = without;
      worst = i;
    }
    if (!worst) break;
    used[*worst] = false;
  }
  return used;
}

}  // namespace

LearnedColor LearnColor(const std::vector<cv::Mat>& images, const std::vector<cv::Mat>& masks,
                        const ColorConfig& base) {
  std::vector<Samples> all;
  for (size_t i = 0; i < images.size(); ++i) all.push_back(SamplesOf(images[i], masks[i]));
  const std::vector<bool> used = Consensus(all, base);
  const ColorConfig range = RangeOf(all, used, base);
  LearnedColor out{range, Separations(all, range)};
  for (size_t i = 0; i < all.size(); ++i) out.pictures[i].used = used[i];
  return out;
}

}  // namespace chase::perception
