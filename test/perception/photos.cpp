// perception_photos: what learning, detector and the whole service do on marked photos of a target
// standing still. Not part of ctest: it takes minutes.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <numeric>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/photo.hpp>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/config/config.h"
#include "common/config/version.h"
#include "deploy/detect/picture.h"
#include "services/perception/belief/perceiver.h"
#include "services/perception/tools/learn.h"

namespace chase::perception {
namespace {

namespace fs = std::filesystem;

constexpr double kFramePeriod = 0.05, kPosePeriod = 0.005;  // s

struct Arguments {
  std::string folder = "../shared/data/target/cone_masks", base;
  size_t train = 3;
  unsigned draws = 50;
  std::vector<int> widths_px = {600, 1200, 300};  ///< that the photos are scaled to
  double field_of_view_deg = 65.0;                ///< of the photos' height
  double dark = 0.0;     ///< brightness of one more training photo; 0: none
  double seconds = 8.0;  ///< that the service is shown a photo
  bool each = false;
};

struct Photo {
  std::string name;
  cv::Mat bgr, mask;
};

std::vector<Photo> LoadPhotos(const fs::path& folder) {
  std::map<std::string, Photo> photos;  // by name: the same order on any machine
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().stem().string();
    const fs::path mask = folder / (name + "_mask.png");
    if (!fs::exists(mask)) continue;
    photos[name] = {name, cv::imread(entry.path().string()),
                    cv::imread(mask.string(), cv::IMREAD_GRAYSCALE)};
  }
  std::vector<Photo> all;
  for (auto& [name, photo] : photos) all.push_back(std::move(photo));
  return all;
}

/// True for those to learn from, by photo.
std::vector<bool> Draw(size_t photos, size_t train, unsigned seed) {
  std::vector<size_t> order(photos);
  std::iota(order.begin(), order.end(), 0u);
  std::mt19937 random(seed);
  for (size_t i = 0; i < train; ++i) std::swap(order[i], order[i + random() % (photos - i)]);
  std::vector<bool> chosen(photos, false);
  for (size_t i = 0; i < train; ++i) chosen[order[i]] = true;
  return chosen;
}

/// As a camera sees it with so much less light: darker, with the same noise of its own.
cv::Mat Darkened(const cv::Mat& bgr, double brightness) {
  constexpr double kNoise = 3.0;  // grey levels, as the simulator's camera
  cv::RNG random(1);
  cv::Mat out, noise(bgr.size(), CV_16SC3);
  random.fill(noise, cv::RNG::NORMAL, 0.0, kNoise);
  bgr.convertTo(out, CV_16SC3, brightness);
  cv::add(out, noise, out);
  out.convertTo(out, CV_8UC3);
  return out;
}

/// The photo without its target: what surrounds it goes on where it was.
cv::Mat Without(const Photo& photo) {
  cv::Mat grown, out;
  const int border = std::max(3, cv::boundingRect(photo.mask).width / 4);
  cv::dilate(photo.mask, grown, cv::Mat::ones(2 * border + 1, 2 * border + 1, CV_8U));
  cv::inpaint(photo.bgr, grown, out, 3.0, cv::INPAINT_TELEA);
  return out;
}

/// With `dark` above 0 the first photo is given once more, darkened to that share.
Learned Learn(const std::vector<Photo>& photos, const std::vector<bool>& chosen,
              const DetectorConfig& base, double dark = 0.0) {
  std::vector<cv::Mat> images, masks;
  for (size_t i = 0; i < photos.size(); ++i)
    if (chosen[i]) images.push_back(photos[i].bgr), masks.push_back(photos[i].mask);
  if (dark > 0.0) images.push_back(Darkened(images[0], dark)), masks.push_back(masks[0]);
  return LearnDetector(images, masks, base);
}

double Mean(const std::vector<double>& values) {
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

void RunDraws(const Arguments& a, const std::vector<Photo>& photos, const DetectorConfig& base) {
  std::vector<double> means;
  std::vector<cv::Mat> absent;
  for (const Photo& photo : photos) absent.push_back(Without(photo));
  std::vector<std::vector<double>> by_photo(photos.size());
  size_t missed = 0, shown = 0, claimed = 0, invented = 0;
  for (unsigned seed = 1; seed <= a.draws; ++seed) {
    const auto chosen = Draw(photos.size(), a.train, seed);
    std::string names;
    for (size_t i = 0; i < photos.size(); ++i) names += chosen[i] ? " " + photos[i].name : "";
    double sum = 0.0;
    std::string refused;
    try {
      const Learned learned = Learn(photos, chosen, base, a.dark);
      for (size_t i = 0; i < photos.size(); ++i) {
        if (chosen[i]) continue;
        const double overlap = Overlap(learned.config, photos[i].bgr, photos[i].mask);
        sum += overlap;
        by_photo[i].push_back(overlap);
        missed += overlap <= 0.0;
        PerceptionConfig config;
        config.detector = learned.config;
        config.state.acquire_score = learned.acquire_score;
        PictureDetector detector(config);
        claimed += detector.Find(photos[i].bgr).has_value();
        invented += detector.Find(absent[i]).has_value();
        ++shown;
      }
    } catch (const std::exception& e) {
      refused = std::string(" refused: ") + e.what();
    }
    means.push_back(sum / static_cast<double>(photos.size() - a.train));
    if (a.each)
      fmt::print("draw {:3d}: mean IoU {:.3f},{}{}\n", seed, means.back(), names, refused);
  }
  if (means.empty()) return;
  for (size_t i = 0; a.each && i < photos.size(); ++i)
    if (!by_photo[i].empty())
      fmt::print("{:<16} shown {:3d} times: mean IoU {:.3f}, missed {}\n", photos[i].name,
                 by_photo[i].size(), Mean(by_photo[i]),
                 std::count(by_photo[i].begin(), by_photo[i].end(), 0.0));
  const double n = static_cast<double>(means.size());
  const double mean = Mean(means);
  double squares = 0.0;
  for (const double m : means) squares += (m - mean) * (m - mean);
  fmt::print(
      "learned from {} of {}, {} draws: mean IoU {:.3f} +- {:.3f} (95 %), least draw {:.3f}, draws "
      "below 0.6: {}; missed {} of {}\n",
      a.train, photos.size(), means.size(), mean,
      1.96 * std::sqrt(squares / std::max(1.0, n - 1.0) / n),
      *std::min_element(means.begin(), means.end()),
      std::count_if(means.begin(), means.end(), [](double m) { return m < 0.6; }), missed, shown);
  fmt::print("accepted: {} of {} with the target, {} of {} where it is painted over\n", claimed,
             shown, invented, shown);
}

cv::Mat Scaled(const cv::Mat& bgr, int width_px) {
  const double scale = static_cast<double>(width_px) / bgr.cols;
  cv::Mat out;
  cv::resize(bgr, out, {}, scale, scale, scale < 1.0 ? cv::INTER_AREA : cv::INTER_CUBIC);
  return out;
}

/// The service shown one photo over and over by a camera that hangs still; no LiDAR.
TargetEstimate Watch(const PerceptionConfig& config, const cv::Mat& bgr, double seconds) {
  Perceiver perceiver(config);
  TargetEstimate last;
  const int every = static_cast<int>(std::lround(kFramePeriod / kPosePeriod));
  for (int k = 0; k * kPosePeriod < seconds; ++k) {
    PoseSample pose;
    pose.t = k * kPosePeriod;
    perceiver.AddPose(pose);
    if (k % every == 0) last = perceiver.See({pose.t, bgr, {}});
    if (last.state == TargetState::kTracking) break;
  }
  return last;
}

double RangeSigma(const TargetEstimate& e) {
  const Eigen::Vector3d sight = e.p_WT.normalized();
  return std::sqrt(sight.dot(e.covariance * sight));
}

/// Number behind "dist" in a photo's name, in the unit that it was written in; 0: none.
double StatedRange(const std::string& name) {
  const auto at = name.find("dist");
  return at == std::string::npos ? 0.0 : std::strtod(name.c_str() + at + 4, nullptr);
}

double Median(std::vector<double> values) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

void RunService(const Arguments& a, const std::vector<Photo>& photos, PerceptionConfig config) {
  const auto chosen = Draw(photos.size(), a.train, 1);
  const Learned learned = Learn(photos, chosen, config.detector);
  config.detector = learned.config;
  config.state.acquire_score = learned.acquire_score;
  // Its height is twice its width at the foot, more or less; a scale is fitted below.
  config.target_radius = 0.5 * config.target_height * config.detector.shape.aspect;
  config.rig.camera_pitch_deg = 0.0;
  config.rig.camera_position.setZero();
  config.motion.pose_sigma = config.motion.tilt_sigma_deg = config.motion.heading_sigma_deg = 0.0;
  for (const int width : a.widths_px) {
    std::vector<double> ranges, sigmas, stated;
    std::map<std::string, int> reasons;
    int tracked = 0, shown = 0;
    for (size_t i = 0; i < photos.size(); ++i) {
      if (chosen[i]) continue;
      const cv::Mat bgr = Scaled(photos[i].bgr, width);
      config.rig.width_px = bgr.cols;
      config.rig.height_px = bgr.rows;
      config.rig.center_u_px = 0.5 * (bgr.cols - 1);
      config.rig.center_v_px = 0.5 * (bgr.rows - 1);
      config.rig.focal_px = 0.5 * bgr.rows / std::tan(0.5 * a.field_of_view_deg * M_PI / 180.0);
      const auto e = Watch(config, bgr, a.seconds);
      ++shown;
      const bool on = e.state == TargetState::kTracking;
      if (a.each)
        fmt::print("{:5d} px {:<16} {} range {:5.2f} sigma {:.3f} box {:.0f}x{:.0f} {}\n", width,
                   photos[i].name, on ? "tracked" : "-      ", on ? e.p_WT.norm() : 0.0,
                   on ? RangeSigma(e) : 0.0, e.box.width, e.box.height, e.note);
      if (!on) {
        ++reasons[e.note];
        for (size_t k = 0; k < e.refused.size(); ++k)
          if (e.refused[k] > 0) ++reasons[kWhyRefused[k]];
        continue;
      }
      ++tracked;
      if (StatedRange(photos[i].name) <= 0.0) continue;
      ranges.push_back(e.p_WT.norm());
      sigmas.push_back(RangeSigma(e));
      stated.push_back(StatedRange(photos[i].name));
    }
    std::vector<double> scales;
    for (size_t i = 0; i < ranges.size(); ++i) scales.push_back(ranges[i] / stated[i]);
    const double scale = Median(scales);
    int inside = 0;
    std::vector<double> errors;
    for (size_t i = 0; i < ranges.size(); ++i) {
      errors.push_back(std::abs(ranges[i] / (scale * stated[i]) - 1.0));
      inside += std::abs(ranges[i] - scale * stated[i]) <= 3.0 * sigmas[i];
    }
    fmt::print(
        "service at {} px wide: tracks {} of {}; ranges to one scale ({:.3f} m a unit): {} of {} "
        "within 3 sigma, median error {:.1f} %, median sigma {:.3f} m\n",
        width, tracked, shown, scale, inside, ranges.size(), 100.0 * Median(errors),
        Median(sigmas));
    for (const auto& [reason, count] : reasons)
      if (!reason.empty()) fmt::print("  {} times: {}\n", count, reason);
  }
}

void Run(const Arguments& a) {
  if (!fs::exists(a.folder))
    throw std::runtime_error(a.folder +
                             ": no such folder; name one of photos NAME.jpg with masks "
                             "NAME_mask.png");
  const auto photos = LoadPhotos(a.folder);
  if (photos.size() <= a.train)
    throw std::runtime_error(
        fmt::format("{}: {} photos with NAME_mask.png, needed are more than "
                    "--train {}",
                    a.folder, photos.size(), a.train));
  PerceptionConfig config;
  if (!a.base.empty()) config::Load(a.base, &config);
  RunDraws(a, photos, config.detector);
  RunService(a, photos, config);
}

}  // namespace
}  // namespace chase::perception

int main(int argc, char** argv) {
  chase::perception::Arguments a;
  CLI::App app("Learning, detector and service on marked photos of a target that stands still.");
  chase::config::AddVersion(&app);
  app.add_option("folder", a.folder,
                 "photos NAME.jpg with masks NAME_mask.png, not 0 on the target");
  app.add_option("--config", a.base, "overrides of perception's config");
  app.add_option("--train", a.train, "photos that are learned from")->check(CLI::PositiveNumber);
  app.add_option("--draws", a.draws, "choices of them, seeds from 1");
  app.add_option("--dark", a.dark, "learn from one of them once more, darkened to this share")
      ->check(CLI::Range(0.0, 1.0));
  app.add_option("--widths", a.widths_px, "that the service is shown the photos at, px");
  app.add_option("--fov", a.field_of_view_deg, "of the photos' height, degrees")
      ->check(CLI::Range(5.0, 160.0));
  app.add_option("--seconds", a.seconds, "that the service is shown each photo");
  app.add_flag("--each", a.each, "a line for every draw and photo");
  try {
    app.parse(argc, argv);
    chase::perception::Run(a);
    return 0;
  } catch (const CLI::Success& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    fmt::print(stderr, "perception_photos: {}; see perception_photos --help\n", e.what());
  } catch (const std::exception& e) {
    fmt::print(stderr, "perception_photos: {}\n", e.what());
  }
  return 1;
}
