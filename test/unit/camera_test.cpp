#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

#include "services/camera/config.h"
#include "services/camera/frame_source.h"
#include "services/camera/image.h"
#include "services/camera/multipart.h"
#include "services/camera/pace.h"

namespace chase::camera {
namespace {

namespace fs = std::filesystem;

fs::path FreshFolder(const std::string& name) {
  const fs::path folder = fs::path(::testing::TempDir()) / name;
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

std::string ErrorOf(const std::string& source) {
  try {
    OpenFrameSource({source});
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "";
}

// Half of a camera's 30 Hz would be 15.
TEST(CameraPace, PublishesTheRateWhateverTheCamerasIs) {
  for (const double camera : {10.0, 20.0, 25.0, 30.0, 59.0, 60.0, 120.0}) {
    Pace pace(50'000);
    int taken = 0;
    int64_t last = 0, longest = 0;
    for (int k = 0; k < static_cast<int>(60.0 * camera); ++k) {
      const int64_t utime = 1'700'000'000'000'000 + static_cast<int64_t>(1e6 * k / camera) +
                            (k * 7919) % 4000;  // of jitter
      if (!pace.Take(utime)) continue;
      if (++taken > 1) longest = std::max(longest, utime - last);
      last = utime;
    }
    EXPECT_NEAR(taken / 60.0, std::min(camera, 20.0), 0.1) << camera;
    EXPECT_LE(longest, static_cast<int64_t>(1e6 * std::max(0.1, 1.0 / camera)) + 4000) << camera;
  }
}

TEST(CameraPace, GoesOnAfterAPauseAndOnAnotherClock) {
  Pace pace(50'000);
  int64_t t = 1'700'000'000'000'000;
  EXPECT_TRUE(pace.Take(t));
  EXPECT_FALSE(pace.Take(t + 33'000));
  t += 9'000'000;
  int taken = 0;
  for (int k = 0; k < 30; ++k) taken += pace.Take(t + 33'333 * k);
  EXPECT_NEAR(taken, 21, 1) << "what was missed is not caught up with";
  pace.Restart();
  EXPECT_TRUE(pace.Take(1'000'000));
}

TEST(CameraImage, ChannelsComeOutAsRgb) {
  const cv::Mat bgr(4, 6, CV_8UC3, cv::Scalar(10, 20, 30));
  EXPECT_EQ(ToRgb(bgr, 0, 0).at<cv::Vec3b>(2, 3), cv::Vec3b(30, 20, 10));
  const cv::Mat bgra(4, 6, CV_8UC4, cv::Scalar(10, 20, 30, 99));
  EXPECT_EQ(ToRgb(bgra, 0, 0).at<cv::Vec3b>(0, 0), cv::Vec3b(30, 20, 10));
  const cv::Mat grey(4, 6, CV_16UC1, cv::Scalar(65535));
  EXPECT_EQ(ToRgb(grey, 0, 0).at<cv::Vec3b>(0, 0), cv::Vec3b(255, 255, 255));
  EXPECT_TRUE(ToRgb({}, 0, 0).empty());
  EXPECT_TRUE(ToRgb(cv::Mat(4, 4, CV_32FC1), 0, 0).empty());
}

/// A circle stays a circle whatever the aspect ratio that comes in.
TEST(CameraImage, ResizingKeepsTheAspectRatio) {
  for (const cv::Size size : {cv::Size(1280, 720), cv::Size(640, 480), cv::Size(400, 900)}) {
    cv::Mat frame(size, CV_8UC3, cv::Scalar::all(0));
    cv::circle(frame, {size.width / 2, size.height / 2}, 100, cv::Scalar::all(255), -1);
    const cv::Mat out = ToRgb(frame, 376, 240);
    ASSERT_EQ(out.size(), cv::Size(376, 240));
    ASSERT_TRUE(out.isContinuous());
    cv::Mat grey;
    cv::cvtColor(out, grey, cv::COLOR_RGB2GRAY);
    const cv::Rect box = cv::boundingRect(grey > 128);
    EXPECT_NEAR(box.width, box.height, 2);
    EXPECT_NEAR(box.x + box.width / 2.0, 188, 2);
  }
}

TEST(CameraSource, AFolderGivesItsImagesByName) {
  const fs::path folder = FreshFolder("camera_folder");
  for (const int k : {2, 0, 1})
    cv::imwrite((folder / ("frame_" + std::to_string(k) + ".png")).string(),
                cv::Mat(8, 8, CV_8UC3, cv::Scalar::all(50 * k)));
  std::ofstream(folder / "notes.txt") << "not an image";
  std::ofstream(folder / "frame_1b.png") << "broken";
  const auto source = OpenFrameSource({folder.string()});
  EXPECT_TRUE(source->IsRecording());
  for (int k = 0; k < 3; ++k) {
    const auto frame = source->Next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->bgr.at<cv::Vec3b>(0, 0)[0], 50 * k);
  }
  EXPECT_FALSE(source->Next());
}

TEST(CameraSource, AVideoGivesAllItsFrames) {
  const std::string file = (FreshFolder("camera_video") / "v.avi").string();
  cv::VideoWriter writer(file, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 20.0, {64, 48});
  ASSERT_TRUE(writer.isOpened());
  for (int k = 0; k < 5; ++k) writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(40 * k)));
  writer.release();
  const auto source = OpenFrameSource({file});
  for (int k = 0; k < 5; ++k) {
    const auto frame = source->Next();
    ASSERT_TRUE(frame);
    EXPECT_NEAR(frame->bgr.at<cv::Vec3b>(20, 20)[1], 40 * k, 4);
  }
  EXPECT_FALSE(source->Next());
}

TEST(CameraSource, BadSourcesAreRefusedInOneLine) {
  EXPECT_NE(ErrorOf("/nonexistent/video").find("no such"), std::string::npos);
  EXPECT_NE(ErrorOf(FreshFolder("camera_empty").string()).find("no image"), std::string::npos);
  const fs::path text = FreshFolder("camera_text") / "a.txt";
  std::ofstream(text) << "not a video";
  EXPECT_NE(ErrorOf(text.string()).find("no video"), std::string::npos);
}

TEST(CameraConfig, ProblemsNameTheField) {
  CameraConfig config;
  EXPECT_EQ(config.Problem(), "");
  config.rate_hz = 0.0;
  EXPECT_NE(config.Problem().find("rate_hz"), std::string::npos);
  config = {};
  config.width_px = 0;
  EXPECT_NE(config.Problem().find("height_px"), std::string::npos);
}

/// Servers differ: hyphens in the header, no lengths, small letters; and bytes come in any pieces.
TEST(CameraMultipart, PartsComeWholeWhateverThePieces) {
  const std::string bodies[] = {"first", std::string("\r\n--no\0boundary", 16), ""};
  for (const bool lengths : {true, false}) {
    for (const std::string boundary : {"mark", "--mark"}) {
      std::string stream =
          "HTTP/1.0 200 OK\r\nServer: x\r\nContent-Type: "
          "multipart/x-mixed-replace; boundary=\"" +
          boundary + "\"\r\n\r\n";
      double t = 1.5;
      for (const std::string& body : bodies) {
        stream += "--mark\r\nContent-Type: image/jpeg\r\n";
        if (lengths) stream += "content-length: " + std::to_string(body.size()) + "\r\n";
        stream += "X-Timestamp: " + std::to_string(t++) + "\r\n\r\n" + body + "\r\n";
      }
      stream += "--mark\r\n";
      for (const size_t piece : {size_t{1}, size_t{7}, stream.size()}) {
        MultipartReader reader;
        std::vector<Part> parts;
        for (size_t at = 0; at < stream.size(); at += piece)
          for (Part& part : reader.Add(reinterpret_cast<const uint8_t*>(stream.data()) + at,
                                       std::min(piece, stream.size() - at)))
            parts.push_back(std::move(part));
        ASSERT_EQ(parts.size(), 3u) << reader.problem() << piece << boundary << lengths;
        for (size_t k = 0; k < 3; ++k) {
          EXPECT_EQ(std::string(parts[k].body.begin(), parts[k].body.end()), bodies[k]);
          EXPECT_EQ(std::stod(parts[k].headers["x-timestamp"]), 1.5 + static_cast<double>(k));
        }
      }
    }
  }
}

TEST(CameraMultipart, WhatIsNoStreamIsSaid) {
  const auto problem = [](const std::string& answer) {
    MultipartReader reader;
    reader.Add(reinterpret_cast<const uint8_t*>(answer.data()), answer.size());
    return reader.problem();
  };
  EXPECT_NE(problem("HTTP/1.1 404 Not Found\r\n").find("404"), std::string::npos);
  EXPECT_NE(problem("HTTP/1.1 200 OK\r\nContent-Type: text/html\r\n\r\n").find("text/html"),
            std::string::npos);
  EXPECT_NE(problem("HTTP/1.1 200 OK\r\nContent-Type: multipart/mixed;boundary=b\r\n\r\n--b\r\n"
                    "Content-Length: 99999999999\r\n\r\n")
                .find("99999999999"),
            std::string::npos);
  EXPECT_NE(problem("SSH-2.0-OpenSSH\r\n").find("SSH"), std::string::npos);
}

}  // namespace
}  // namespace chase::camera
