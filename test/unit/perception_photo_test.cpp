// Real photos of an orange cone with pixel masks: ../shared/data/target/cone_masks.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "services/perception/belief/perceiver.h"
#include "services/perception/sight/color_detector.h"
#include "services/perception/tools/learn.h"

namespace chase::perception {
namespace {

namespace fs = std::filesystem;

struct Photo {
  std::string name;
  cv::Mat bgr, mask;
};

std::vector<Photo> LoadPhotos() {
  std::vector<Photo> photos;
  const fs::path folder = "../shared/data/target/cone_masks";  // tests run in the project's root
  if (!fs::exists(folder)) return photos;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().stem().string();
    if (entry.path().extension() != ".jpg") continue;
    photos.push_back({name, cv::imread(entry.path().string()),
                      cv::imread((folder / (name + "_mask.png")).string(), cv::IMREAD_GRAYSCALE)});
  }
  std::sort(photos.begin(), photos.end(),
            [](const Photo& a, const Photo& b) { return a.name < b.name; });
  return photos;
}

/// The colours are set from these three alone: shade, sun and lamp light.
bool ForTraining(const Photo& photo) {
  return photo.name == "train_4_dist5" || photo.name == "train_6_dist10" ||
         photo.name == "train_20_dist8";
}

/// The first complaint of the config or of those in it.
std::string ProblemOf(const DetectorConfig& config) {
  for (const auto& problem : {config.Problem(), config.color.Problem(), config.shape.Problem(),
                              config.marker.Problem(), config.network.Problem()})
    if (!problem.empty()) return problem;
  return "";
}

TEST(PerceptionPhotos, TheConeIsFoundInRealPhotos) {
  const auto photos = LoadPhotos();
  if (photos.empty()) GTEST_SKIP() << "skipped: real recordings not present";
  std::vector<cv::Mat> images, masks;
  for (const auto& p : photos)
    if (ForTraining(p)) images.push_back(p.bgr), masks.push_back(p.mask);
  ASSERT_EQ(images.size(), 3u);
  // As `chase-perception --learn-colour` does. The masks were drawn by hand well inside the cone's
  // outline; how far is learned from the same three.
  const Learned learned = LearnDetector(images, masks, {});
  ASSERT_EQ(ProblemOf(learned.config), "");
  DetectorConfig whole = learned.config;
  whole.shape.inset = 0.0;
  double sum = 0.0, outline = 0.0;
  int count = 0;
  for (const auto& p : photos) {
    if (ForTraining(p)) continue;
    const double overlap = Overlap(learned.config, p.bgr, p.mask);
    EXPECT_GT(overlap, 0.0) << p.name;
    sum += overlap;
    outline += Overlap(whole, p.bgr, p.mask);
    ++count;
  }
  EXPECT_EQ(count, 17);
  EXPECT_GE(sum / count, 0.7);
  EXPECT_GE(outline / count, 0.6);  // of the whole cone with the masks as they were drawn
  RecordProperty("mean_iou_percent", static_cast<int>(100.0 * sum / count));
  RecordProperty("mean_iou_of_outline_percent", static_cast<int>(100.0 * outline / count));
  std::cout << "mean IoU " << sum / count << ", of the whole outline " << outline / count << "\n";
}

/// An upright orange thing, marked less wide than it is.
struct Marked {
  cv::Mat bgr = cv::Mat(240, 320, CV_8UC3, cv::Scalar(120, 125, 130));
  cv::Mat mask = cv::Mat::zeros(240, 320, CV_8U);

  Marked(int x, int width, int border) {
    const cv::Rect box(x, 60, width, 2 * width);
    bgr(box).setTo(cv::Scalar(20, 110, 240));
    mask(box - cv::Point(-border, -border) - cv::Size(2 * border, 2 * border)).setTo(255);
  }
};

TEST(PerceptionLearn, FindsHowFarInsideTheColoursEdgeTheTargetIsMarked) {
  for (const int border : {0, 4, 8}) {
    const Marked a(40, 50, border), b(200, 50, border);
    const Learned learned = LearnDetector({a.bgr}, {a.mask}, {});
    EXPECT_NEAR(learned.config.shape.inset, border / 50.0, 0.011);
    EXPECT_GT(learned.overlap, 0.97);
    EXPECT_GT(Overlap(learned.config, b.bgr, b.mask), 0.97) << border;
  }
}

/// The same scene with grey noise and with so much of its light.
cv::Mat Noisy(const Marked& from, double brightness, uint64_t seed) {
  cv::Mat out, noise(from.bgr.size(), CV_16SC3);
  cv::RNG(seed).fill(noise, cv::RNG::NORMAL, 0.0, 4.0);
  from.bgr.convertTo(out, CV_16SC3, brightness);
  cv::add(out, noise, out);
  out.convertTo(out, CV_8UC3);
  return out;
}

TEST(PerceptionLearn, APictureInTheDarkDoesNotWidenTheColours) {
  Marked a(40, 50, 0), b(200, 50, 0), c(120, 40, 0);
  for (Marked* m : {&a, &b, &c}) {  // red, brown and yellow things lie about
    m->bgr(cv::Rect(0, 0, 320, 20)).setTo(cv::Scalar(20, 20, 160));
    m->bgr(cv::Rect(0, 20, 320, 20)).setTo(cv::Scalar(25, 50, 80));
    m->bgr(cv::Rect(0, 180, 320, 40)).setTo(cv::Scalar(30, 190, 210));
  }
  for (uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    const std::vector<cv::Mat> lit = {Noisy(a, 1.0, seed), Noisy(b, 0.9, seed + 10)};
    const Learned without = LearnDetector(lit, {a.mask, b.mask}, {});
    const Learned with =
        LearnDetector({lit[0], lit[1], Noisy(c, 0.05, seed + 20)}, {a.mask, b.mask, c.mask}, {});
    EXPECT_FALSE(with.color.pictures[2].used);
    EXPECT_TRUE(with.color.pictures[0].used && with.color.pictures[1].used);
    EXPECT_DOUBLE_EQ(with.config.color.hue_min_deg, without.config.color.hue_min_deg);
    EXPECT_DOUBLE_EQ(with.config.color.hue_max_deg, without.config.color.hue_max_deg);
    EXPECT_DOUBLE_EQ(with.config.color.saturation_min, without.config.color.saturation_min);
    EXPECT_DOUBLE_EQ(with.config.color.value_min, without.config.color.value_min);
  }
}

TEST(PerceptionLearn, SaysHowWellItSeparates) {
  const Marked a(40, 50, 0);
  Marked redder(200, 50, 0);
  redder.bgr(cv::Rect(200, 60, 50, 100)).setTo(cv::Scalar(20, 70, 240));
  const Learned learned =
      LearnDetector({a.bgr, a.bgr, redder.bgr}, {a.mask, a.mask, redder.mask}, {});
  for (const auto& p : learned.color.pictures) {
    EXPECT_TRUE(p.used);
    EXPECT_GT(p.target, 0.99);
    EXPECT_LT(p.far, 0.01);
  }
}

TEST(PerceptionLearn, TheShapeComesFromWholeBlobsThatAreMarked) {
  const Marked whole(40, 50, 0);
  Marked cut(40, 50, 0), elsewhere(40, 50, 0);
  cut.bgr = cut.bgr.colRange(65, 320).clone();  // half of it, twice as slim
  cut.mask = cut.mask.colRange(65, 320).clone();
  elsewhere.bgr(cv::Rect(40, 60, 50, 100)).setTo(cv::Scalar(120, 125, 130));
  elsewhere.bgr(cv::Rect(100, 180, 200, 40)).setTo(cv::Scalar(20, 110, 240));
  elsewhere.mask = 0;
  elsewhere.mask(cv::Rect(40, 60, 10, 10)).setTo(255);  // too few pixels to change the colour
  for (const auto& other : {cut, elsewhere}) {
    const Learned learned = LearnDetector({whole.bgr, other.bgr}, {whole.mask, other.mask}, {});
    EXPECT_NEAR(learned.config.shape.aspect, 0.5, 0.01);
    EXPECT_EQ(ProblemOf(learned.config), "");
  }
}

TEST(PerceptionLearn, SaysWhyNoPictureShowsTheShape) {
  Marked cut(40, 50, 0);
  cut.bgr = cut.bgr.colRange(65, 320).clone();
  cut.mask = cut.mask.colRange(65, 320).clone();
  Marked tiny(40, 50, 0);  // its own blob is noise
  tiny.bgr(cv::Rect(40, 60, 50, 100)).setTo(cv::Scalar(120, 125, 130));
  tiny.bgr(cv::Rect(100, 100, 3, 3)).setTo(cv::Scalar(20, 110, 240));
  tiny.mask = 0;
  tiny.mask(cv::Rect(100, 100, 3, 3)).setTo(255);
  try {
    LearnDetector({cut.bgr, tiny.bgr}, {cut.mask, tiny.mask}, {});
    FAIL();
  } catch (const std::invalid_argument& e) {
    const std::string message = e.what();
    for (const char* said : {"pair 1: the image cuts", "pair 2: no blob", "give"})
      EXPECT_NE(message.find(said), std::string::npos) << said << " in: " << message;
  }
}

TEST(PerceptionLearn, RefusesWhatDoesNotFitTogether) {
  const Marked a(40, 50, 0);
  EXPECT_THROW(LearnDetector({}, {}, {}), std::invalid_argument);
  EXPECT_THROW(LearnDetector({a.bgr}, {a.mask, a.mask}, {}), std::invalid_argument);
  EXPECT_THROW(LearnDetector({a.bgr}, {a.bgr}, {}), std::invalid_argument);
  EXPECT_THROW(LearnDetector({a.bgr}, {a.mask.rowRange(0, 100)}, {}), std::invalid_argument);
  EXPECT_THROW(LearnDetector({a.bgr}, {cv::Mat::zeros(a.mask.size(), CV_8U)}, {}),
               std::invalid_argument);
  EXPECT_THROW(LearnDetector({a.bgr}, {cv::Mat::ones(a.mask.size(), CV_8U)}, {}),
               std::invalid_argument);
  cv::Mat photo(a.mask.size(), CV_8U);
  for (int row = 0; row < photo.rows; ++row) photo.row(row).setTo(row);
  EXPECT_THROW(LearnDetector({a.bgr}, {photo}, {}), std::invalid_argument);
}

/// The same thing cut to another outline.
Marked Shaped(const std::vector<cv::Point>& outline) {
  Marked shaped(40, 50, 0);
  const cv::Scalar ground(120, 125, 130);
  cv::Mat mask = cv::Mat::zeros(shaped.mask.size(), CV_8U);
  cv::fillPoly(mask, std::vector<std::vector<cv::Point>>{outline}, 255);
  shaped.bgr.setTo(ground);
  shaped.bgr.setTo(cv::Scalar(20, 110, 240), mask);
  shaped.mask = mask;
  return shaped;
}

Marked Cone() { return Shaped({{135, 70}, {145, 70}, {165, 170}, {115, 170}}); }

TEST(PerceptionLearn, PartsTheTargetFromWhatLooksAlikeInThePictures) {
  Marked a(40, 50, 0);
  a.bgr(cv::Rect(180, 100, 40, 60)).setTo(cv::Scalar(20, 110, 240));  // wider
  const Learned learned = LearnDetector({a.bgr}, {a.mask}, {});
  const auto found = ColorDetector(learned.config, 1.0).Detect(a.bgr);
  ASSERT_GE(found.size(), 2u);
  EXPECT_GT(found[0].score, learned.acquire_score);
  EXPECT_LT(found[1].score, learned.acquire_score);
  EXPECT_GT(found[1].score, StateConfig{}.acquire_score);  // it was taken for the target
}

TEST(PerceptionLearn, TellsHowFarTheOutlineIsFromTheModels) {
  const auto departure = [](const Marked& m) {
    return LearnDetector({m.bgr}, {m.mask}, {}).config.shape.outline_sigma;
  };
  EXPECT_LT(departure(Marked(40, 50, 0)), 0.01);
  std::vector<cv::Point> round;
  cv::ellipse2Poly({140, 120}, {40, 40}, 0, 0, 360, 3, round);
  EXPECT_LT(departure(Shaped(round)), 0.02);
  EXPECT_GT(departure(Cone()), 0.1);
}

// Its sides lean by pixels in a large image; its height tells the range all the same.
TEST(PerceptionLearn, AConeIsTrackedAtARangeWithinItsSigma) {
  const Marked cone = Cone();
  PerceptionConfig config;
  config.detector = LearnDetector({cone.bgr}, {cone.mask}, {}).config;
  config.rig.width_px = cone.bgr.cols, config.rig.height_px = cone.bgr.rows;
  config.rig.center_u_px = 159.5;
  config.rig.camera_pitch_deg = 0.0;
  config.target_height = 1.0;
  config.target_radius = 0.25;
  const double range = config.rig.focal_px * config.target_height / 100.0;
  const auto watch = [&] {
    Perceiver perceiver(config);
    TargetEstimate seen;
    for (int k = 0; k < 1000 && seen.state != TargetState::kTracking; ++k) {
      PoseSample pose;
      pose.t = 0.005 * k;
      perceiver.AddPose(pose);
      if (k % 10 == 0) seen = perceiver.See({pose.t, cone.bgr, {}});
    }
    return seen;
  };
  const TargetEstimate seen = watch();
  ASSERT_EQ(seen.state, TargetState::kTracking);
  const double sigma = std::sqrt(seen.covariance(0, 0));
  EXPECT_LT(std::abs(seen.p_WT.x() - range), 3.0 * sigma);
  EXPECT_LT(sigma, 0.25 * range);
  config.detector.shape.outline_sigma = 0.0;
  EXPECT_NE(watch().state, TargetState::kTracking);
}

TEST(PerceptionLearn, TakesAMaskWithASoftEdge) {
  Marked a(40, 50, 0);
  cv::GaussianBlur(a.mask, a.mask, {5, 5}, 1.0);
  EXPECT_NO_THROW(LearnDetector({a.bgr}, {a.mask}, {}));
}

}  // namespace
}  // namespace chase::perception
