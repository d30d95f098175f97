#include "services/camera/camera_node.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "chase/camera_image_t.hpp"
#include "common/bus/image_format.h"
#include "common/bus/lockstep.h"
#include "common/bus/validation.h"
#include "services/camera/image.h"

namespace chase::camera {
namespace {

namespace fs = std::filesystem;

TEST(CameraNode, AFolderIsPublishedAtTheRateAndThenItIsDone) {
  const fs::path folder = fs::path(::testing::TempDir()) / "camera_node";
  fs::remove_all(folder);
  fs::create_directories(folder);
  for (int k = 0; k < 4; ++k)
    cv::imwrite((folder / ("f" + std::to_string(k) + ".png")).string(),
                cv::Mat(480, 752, CV_8UC3, cv::Scalar(0, 0, 40 * k)));
  CameraConfig config;
  config.source = folder.string();
  std::vector<camera_image_t> images;
  const bus::Node* node = nullptr;
  bus::Lockstep lockstep(1'000'000);
  lockstep.Add("camera", 0, [&](bus::Bus& bus) {
    auto made = std::make_unique<CameraNode>(bus, config);
    node = made.get();
    return made;
  });
  lockstep.SetTap([&](int64_t, const std::string& channel, const bus::Bus::Bytes& bytes) {
    camera_image_t image;
    if (channel == "CAMERA_IMAGE" &&
        image.decode(bytes.data(), 0, static_cast<int>(bytes.size())) > 0)
      images.push_back(image);
  });
  lockstep.RunUntil(1'500'000);
  ASSERT_EQ(images.size(), 4u);
  for (size_t k = 0; k < images.size(); ++k) {
    EXPECT_EQ(images[k].width, 376);
    EXPECT_EQ(images[k].height, 240);
    EXPECT_EQ(images[k].size, 3 * 376 * 240);
    EXPECT_EQ(images[k].data[0], 40 * k);  // red comes first
    EXPECT_EQ(images[k].data[2], 0);
    EXPECT_EQ(images[k].utime, images[0].utime + 50'000 * static_cast<int64_t>(k));
  }
  EXPECT_TRUE(node->Done());
}

/// A raw frame of 1280 x 720 is larger than the bus's receive buffers.
TEST(CameraNode, ALargeImageTravelsAsJpegAndIsGood) {
  const fs::path folder = fs::path(::testing::TempDir()) / "camera_large";
  fs::remove_all(folder);
  fs::create_directories(folder);
  cv::Mat picture(720, 1280, CV_8UC3, cv::Scalar(200, 100, 40));
  cv::imwrite((folder / "f.png").string(), picture);
  for (const double limit : {1.0, 0.1}) {
    CameraConfig config;
    config.source = folder.string();
    config.raw_limit_mb = limit;
    if (limit == 1.0) config.width_px = config.height_px = 0;
    std::vector<camera_image_t> images;
    bus::Lockstep lockstep(1'000'000);
    lockstep.Add("camera", 0,
                 [&](bus::Bus& bus) { return std::make_unique<CameraNode>(bus, config); });
    lockstep.SetTap([&](int64_t, const std::string& channel, const bus::Bus::Bytes& bytes) {
      camera_image_t image;
      if (channel == "CAMERA_IMAGE" &&
          image.decode(bytes.data(), 0, static_cast<int>(bytes.size())) > 0)
        images.push_back(image);
    });
    lockstep.RunUntil(1'500'000);
    ASSERT_EQ(images.size(), 1u);
    const camera_image_t& m = images[0];
    ASSERT_EQ(m.pixelformat, bus::kPixelFormatMjpeg);
    EXPECT_LT(m.size, 100'000);
    EXPECT_EQ(bus::Problem(m), "");
    const cv::Mat decoded = cv::imdecode(m.data, cv::IMREAD_COLOR);
    EXPECT_EQ(decoded.cols, m.width);
    EXPECT_EQ(decoded.rows, m.height);
    EXPECT_NEAR(decoded.at<cv::Vec3b>(100, 100)[0], 200, 3);
  }
}

/// Noise is what JPEG is worst at.
TEST(CameraNode, AJpegThatIsTooLargeForTheBusIsOfLessQuality) {
  const fs::path folder = fs::path(::testing::TempDir()) / "camera_noise";
  fs::remove_all(folder);
  fs::create_directories(folder);
  cv::Mat noise(1500, 2000, CV_8UC3);
  cv::theRNG().state = 1;
  cv::randu(noise, 0, 256);
  cv::imwrite((folder / "f.png").string(), noise);
  ASSERT_GT(ToJpeg(noise, CameraConfig().jpeg_quality, 1'000'000'000).size(), 2'097'152u);
  EXPECT_TRUE(ToJpeg(noise, 90, 10'000).empty());
  CameraConfig config;
  config.source = folder.string();
  config.width_px = config.height_px = 0;
  int images = 0;
  bus::Lockstep lockstep(1'000'000);
  lockstep.Add("camera", 0,
               [&](bus::Bus& bus) { return std::make_unique<CameraNode>(bus, config); });
  lockstep.SetTap([&](int64_t, const std::string& channel, const bus::Bus::Bytes& bytes) {
    camera_image_t image;
    if (channel != "CAMERA_IMAGE" ||
        image.decode(bytes.data(), 0, static_cast<int>(bytes.size())) <= 0)
      return;
    ++images;
    EXPECT_LE(image.size, 1'500'000);
    EXPECT_EQ(cv::imdecode(image.data, cv::IMREAD_COLOR).size(), noise.size());
  });
  lockstep.RunUntil(1'200'000);
  EXPECT_EQ(images, 1);
}

}  // namespace
}  // namespace chase::camera
