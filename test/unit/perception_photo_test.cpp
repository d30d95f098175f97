// Real photos of an orange cone with pixel masks: ../shared/data/target/cone_masks.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "services/perception/color_detector.h"

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

/// The blob, made smaller all around by `inset`, a share of its width.
cv::Mat Region(const Detection& d, const cv::Size& size, double inset) {
  cv::Mat region = cv::Mat::zeros(size, CV_8U), distance;
  d.mask.copyTo(region(d.mask_box));
  cv::distanceTransform(region, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  return distance > inset * d.box.width;
}

double IoU(const cv::Mat& region, const cv::Mat& mask) {
  const double both = cv::countNonZero((region > 0) & (mask > 0));
  return both / cv::countNonZero((region > 0) | (mask > 0));
}

/// The best region's overlap with the mask, 0 where nothing is found.
double Score(const ColorDetector& detector, const Photo& photo, double inset) {
  const auto found = detector.Detect(photo.bgr);
  return found.empty() ? 0.0 : IoU(Region(found.front(), photo.mask.size(), inset), photo.mask);
}

TEST(PerceptionPhotos, TheConeIsFoundInRealPhotos) {
  const auto photos = LoadPhotos();
  if (photos.empty()) GTEST_SKIP() << "skipped: real recordings not present";
  std::vector<cv::Mat> images, masks;
  for (const auto& p : photos)
    if (ForTraining(p)) images.push_back(p.bgr), masks.push_back(p.mask);
  ASSERT_EQ(images.size(), 3u);
  DetectorConfig config;
  config.color.white_balance = false;
  config.color = LearnColor(images, masks, config.color);
  config.shape.aspect = 0.48;  // a cone's
  config.shape.fill = 0.6;
  ASSERT_EQ(config.Problem(), "");
  const ColorDetector detector(config, 0.5);
  // The masks were drawn by hand well inside the cone's outline. How far is learned from the same
  // three photos, so that the overlap measures what was found and not how the masks were drawn.
  double inset = 0.0, best = 0.0;
  for (double share = 0.0; share < 0.2; share += 0.01) {
    double trained = 0.0;
    for (const auto& p : photos)
      if (ForTraining(p)) trained += Score(detector, p, share) / 3.0;
    if (trained > best) best = trained, inset = share;
  }
  double sum = 0.0, outline = 0.0;
  int count = 0;
  for (const auto& p : photos) {
    if (ForTraining(p)) continue;
    const double iou = Score(detector, p, inset);
    EXPECT_GT(iou, 0.0) << p.name;
    sum += iou;
    outline += Score(detector, p, 0.0);
    ++count;
  }
  EXPECT_EQ(count, 17);
  EXPECT_GE(sum / count, 0.7);
  EXPECT_GE(outline / count, 0.6);  // of the whole cone with the masks as they were drawn
  RecordProperty("mean_iou_percent", static_cast<int>(100.0 * sum / count));
  RecordProperty("mean_iou_of_outline_percent", static_cast<int>(100.0 * outline / count));
  std::cout << "mean IoU " << sum / count << ", of the whole outline " << outline / count << "\n";
}

}  // namespace
}  // namespace chase::perception
