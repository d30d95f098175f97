#include "services/camera/frame_source.h"

#include <algorithm>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <stdexcept>
#include <vector>

namespace chase::camera {
namespace {

namespace fs = std::filesystem;

class FolderSource : public FrameSource {
 public:
  explicit FolderSource(std::vector<fs::path> files) : files_(std::move(files)) {}
  std::optional<cv::Mat> Next() override {
    while (next_ < files_.size()) {
      cv::Mat frame = cv::imread(files_[next_++].string(), cv::IMREAD_COLOR);
      if (!frame.empty()) return frame;
    }
    return std::nullopt;
  }
  bool IsRecording() const override { return true; }

 private:
  std::vector<fs::path> files_;
  size_t next_ = 0;
};

class VideoSource : public FrameSource {
 public:
  VideoSource(const cv::VideoCapture& capture, bool recording)
      : capture_(capture), recording_(recording) {}
  std::optional<cv::Mat> Next() override {
    cv::Mat frame;
    if (!capture_.read(frame) || frame.empty()) return std::nullopt;
    return frame;
  }
  bool IsRecording() const override { return recording_; }

 private:
  cv::VideoCapture capture_;
  bool recording_;
};

std::unique_ptr<FrameSource> OpenFolder(const std::string& folder) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder))
    if (entry.is_regular_file() && cv::haveImageReader(entry.path().string()))
      files.push_back(entry.path());
  if (files.empty())
    throw std::runtime_error(folder + ": no image in this folder; give one with PNG or JPEG files");
  std::sort(files.begin(), files.end());
  return std::make_unique<FolderSource>(std::move(files));
}

std::unique_ptr<FrameSource> OpenDevice(const std::string& device, double rate_hz) {
  cv::VideoCapture capture(device, cv::CAP_V4L2);
  if (!capture.isOpened())
    throw std::runtime_error(device +
                             ": camera cannot be opened; check that it is plugged in, that no "
                             "other program holds it and that you are in the group video");
  capture.set(cv::CAP_PROP_BUFFERSIZE, 1);
  capture.set(cv::CAP_PROP_FPS, rate_hz);
  return std::make_unique<VideoSource>(std::move(capture), false);
}

}  // namespace

std::unique_ptr<FrameSource> OpenFrameSource(const std::string& source, double rate_hz) {
  const auto status = fs::status(source);
  if (!fs::exists(status))
    throw std::runtime_error(source + ": no such device, file or folder; set source");
  if (fs::is_directory(status)) return OpenFolder(source);
  if (fs::is_character_file(status)) return OpenDevice(source, rate_hz);
  cv::VideoCapture capture(source, cv::CAP_FFMPEG);
  if (!capture.isOpened())
    throw std::runtime_error(source + ": no video that OpenCV can read; convert it to MP4 or AVI");
  return std::make_unique<VideoSource>(std::move(capture), true);
}

}  // namespace chase::camera
