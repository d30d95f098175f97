#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <string>
#include <vector>

#include "common/config/config.h"
#include "deploy/detect/detect_command.h"
#include "deploy/detect/picture.h"
#include "services/perception/tools/learn.h"

namespace chase::perception {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const cv::Scalar kOrange(20, 110, 240), kGrey(120, 125, 130);
const cv::Rect kPlace(177, 101, 22, 38);  // level with a camera that looks straight ahead

cv::Mat Scene(const cv::Scalar& color) {
  cv::Mat bgr(240, 376, CV_8UC3, kGrey);
  bgr(kPlace).setTo(color);
  return bgr;
}

cv::Mat MaskOf(const cv::Rect& place) {
  cv::Mat mask = cv::Mat::zeros(240, 376, CV_8U);
  mask(place).setTo(255);
  return mask;
}

/// The default config's orange cylinder, 0.5 m high.
TEST(PerceptionPicture, GivesRegionAndRangeAtAnyResolution) {
  PerceptionConfig config;
  config.rig.camera_pitch_deg = 0.0;
  PictureDetector detector(config);
  const double range = config.rig.focal_px * config.target_height / kPlace.height;
  for (const double scale : {1.0, 2.0, 4.0}) {
    cv::Mat bgr, mask;
    cv::resize(Scene(kOrange), bgr, {}, scale, scale, cv::INTER_NEAREST);
    cv::resize(MaskOf(kPlace), mask, {}, scale, scale, cv::INTER_NEAREST);
    const auto target = detector.Find(bgr);
    ASSERT_TRUE(target) << scale;
    EXPECT_GT(Overlap(target->detection, mask), 0.95) << scale;
    ASSERT_TRUE(target->range) << scale;
    EXPECT_NEAR(*target->range, range, 0.06 * range) << scale;
  }
  const auto cropped = detector.Find(Scene(kOrange).rowRange(40, 160).clone());
  ASSERT_TRUE(cropped);
  EXPECT_FALSE(cropped->range) << "another part of the world: no camera is known";
}

TEST(PerceptionPicture, NoneIsAnAnswer) {
  EXPECT_FALSE(PictureDetector({}).Find(Scene({200, 60, 20})));
  EXPECT_FALSE(PictureDetector({}).Find(Scene(kGrey)));
}

TEST(PerceptionPicture, CountsWhatIsFoundMissedAndInvented) {
  const auto seen = PictureDetector({}).Find(Scene(kOrange));
  Evaluation e;
  e.Add(seen, MaskOf(kPlace));                           // found
  e.Add(seen, MaskOf(kPlace + cv::Point(15, 0)));        // overlaps by a fifth
  e.Add(std::nullopt, MaskOf(kPlace));                   // missed
  e.Add(seen, cv::Mat::zeros(240, 376, CV_8U));          // there was none
  e.Add(std::nullopt, cv::Mat::zeros(240, 376, CV_8U));  // rightly none
  EXPECT_DOUBLE_EQ(e.precision(), 1.0 / 3.0);
  EXPECT_DOUBLE_EQ(e.recall(), 1.0 / 3.0);
  const double aside = 7.0 / (2.0 * 22.0 - 7.0);
  EXPECT_NEAR(e.mean_overlap(), (1.0 + aside) / 3.0, 0.05);
}

struct Ran {
  int code;
  std::string out, err;
};

Ran Command(std::vector<std::string> words) {
  words.insert(words.begin(), "chase-detect");
  std::vector<char*> argv;
  for (auto& word : words) argv.push_back(word.data());
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  const int code = Detect(static_cast<int>(argv.size()), argv.data());
  std::fflush(stdout);
  return {code, testing::internal::GetCapturedStdout(), testing::internal::GetCapturedStderr()};
}

class DetectCommand : public testing::Test {
 protected:
  DetectCommand() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    cv::imwrite(File("a.png"), Scene(kOrange));
    cv::imwrite(File("a_mask.png"), MaskOf(kPlace));
    cv::imwrite(File("b.png"), Scene(kGrey));
    cv::imwrite(File("b_mask.png"), cv::Mat::zeros(240, 376, CV_8U));
  }
  ~DetectCommand() override { fs::remove_all(folder_); }
  std::string File(const std::string& name) const { return (folder_ / name).string(); }

  const fs::path folder_ = fs::path(testing::TempDir()) / "detect";
};

TEST_F(DetectCommand, WritesJsonPicturesAndFigures) {
  const Ran ran =
      Command({folder_.string(), "--json", "--out", File("out"), "--evaluate", folder_.string()});
  ASSERT_EQ(ran.code, 0) << ran.err;
  const json result = json::parse(ran.out);
  ASSERT_EQ(result["pictures"].size(), 2u) << "masks are no pictures";
  const json& found = result["pictures"][0]["detections"];
  ASSERT_EQ(found.size(), 1u);
  EXPECT_NEAR(found[0]["box_px"][0].get<double>(), kPlace.x, 1.5);
  EXPECT_NEAR(found[0]["box_px"][3].get<double>(), kPlace.height, 1.5);
  EXPECT_GE(found[0]["outline_px"].size(), 4u);
  EXPECT_GT(found[0]["range_m"].get<double>(), 1.0);
  EXPECT_TRUE(result["pictures"][1]["detections"].empty());
  EXPECT_EQ(result["evaluation"]["precision"], 1.0);
  EXPECT_EQ(result["evaluation"]["recall"], 1.0);
  const cv::Mat drawn = cv::imread(File("out/a.png.png"));
  ASSERT_EQ(drawn.size(), cv::Size(376, 240));
  EXPECT_GT(cv::norm(drawn, Scene(kOrange)), 0.0);
}

TEST_F(DetectCommand, PicturesCalledAlikeAreAllWritten) {
  for (const std::string folder : {"x", "y"}) {
    fs::create_directories(folder_ / folder);
    cv::imwrite(File(folder + "/a.png"), Scene(folder == "x" ? kOrange : kGrey));
  }
  ASSERT_EQ(Command({File("x"), File("y"), "--out", File("out")}).code, 0);
  const cv::Mat first = cv::imread(File("out/a.png.png")),
                second = cv::imread(File("out/a.png-2.png"));
  ASSERT_EQ(first.size(), second.size());
  EXPECT_GT(cv::norm(first, second), 0.0);
}

TEST_F(DetectCommand, ReadsTheFramesOfAVideo) {
  const std::string file = File("c.avi");
  cv::VideoWriter video(file, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 10.0, {376, 240});
  ASSERT_TRUE(video.isOpened());
  for (int i = 0; i < 3; ++i) video.write(Scene(i == 1 ? kGrey : kOrange));
  video.release();
  const json result = json::parse(Command({file, "--json"}).out);
  ASSERT_EQ(result["pictures"].size(), 3u);
  EXPECT_EQ(result["pictures"][2]["file"], file + "#2");
  EXPECT_EQ(result["pictures"][0]["detections"].size(), 1u);
  EXPECT_EQ(result["pictures"][1]["detections"].size(), 0u);
  for (int i = 0; i < 3; ++i)
    cv::imwrite(File("c-" + std::to_string(i) + "_mask.png"), MaskOf(i == 1 ? cv::Rect() : kPlace));
  const Ran ran = Command({file, "--json", "--evaluate", folder_.string()});
  ASSERT_EQ(ran.code, 0) << ran.err;
  EXPECT_EQ(json::parse(ran.out)["evaluation"]["found"], 2);
}

TEST_F(DetectCommand, GoesOnAfterWhatItCannotReadAndSaysWhy) {
  std::ofstream(File("text.txt")) << "no picture";
  const Ran ran = Command({File("none.png"), File("text.txt"), File("a.png")});
  EXPECT_EQ(ran.code, 1);
  for (const char* said : {"none.png: no such file", "text.txt: neither a picture nor a video"})
    EXPECT_NE(ran.err.find(said), std::string::npos) << ran.err;
  EXPECT_NE(ran.out.find("a.png: score"), std::string::npos) << ran.out;
  EXPECT_EQ(Command({}).code, 1);
  EXPECT_EQ(Command({"--help"}).code, 0);
  EXPECT_EQ(Command({File("a.png"), "--config", File("text.txt")}).code, 1);
}

TEST_F(DetectCommand, OneBadFileOfAFolderDoesNotHideTheOthers) {
  std::ofstream(File("0.png")) << "no picture";
  const Ran ran = Command({folder_.string()});
  EXPECT_EQ(ran.code, 1);
  EXPECT_NE(ran.err.find("0.png: cannot be read"), std::string::npos) << ran.err;
  for (const char* said : {"a.png: score", "b.png: none"})
    EXPECT_NE(ran.out.find(said), std::string::npos) << ran.out;
}

TEST_F(DetectCommand, APictureIsNotItsOwnMask) {
  fs::remove(File("b_mask.png"));
  const Ran ran = Command({folder_.string(), "--evaluate", folder_.string()});
  EXPECT_EQ(ran.code, 1);
  EXPECT_NE(ran.err.find("b.png: neither b_mask.png nor b.png"), std::string::npos) << ran.err;
}

}  // namespace
}  // namespace chase::perception
