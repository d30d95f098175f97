#include "services/camera/frame_source.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <stdexcept>
#include <utility>
#include <vector>

#include "services/camera/mjpeg_source.h"

namespace chase::camera {
namespace {

namespace fs = std::filesystem;

class FolderSource : public FrameSource {
 public:
  explicit FolderSource(std::vector<fs::path> files) : files_(std::move(files)) {}
  std::optional<Frame> Next() override {
    while (next_ < files_.size()) {
      Frame frame;
      frame.bgr = cv::imread(files_[next_++].string(), cv::IMREAD_COLOR);
      if (!frame.bgr.empty()) return frame;
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
  using Open = std::function<cv::VideoCapture()>;  ///< throws std::runtime_error

  /// `clock`: of CAP_PROP_POS_MSEC, where the backend says with it when a frame was captured.
  VideoSource(Open open, bool recording, StampClock clock)
      : open_(std::move(open)), capture_(open_()), recording_(recording), clock_(clock) {}
  std::optional<Frame> Next() override {
    Frame frame;
    if (!Read(&frame.bgr)) return std::nullopt;
    if (clock_ == StampClock::kNone) return frame;
    frame.stamp = std::llround(1e3 * capture_.get(cv::CAP_PROP_POS_MSEC));
    if (frame.stamp > 0) frame.clock = clock_;
    if (clock_ == StampClock::kMonotonic)  // V4L2 counts in 100 us
      frame.exposure = std::max(0.0, 1e-4 * capture_.get(cv::CAP_PROP_EXPOSURE));
    return frame;
  }
  bool IsRecording() const override { return recording_; }
  std::string Problem() const override { return problem_; }

 private:
  /// A device or stream that gives nothing is closed, and opened anew the next time.
  bool Read(cv::Mat* bgr) {
    try {
      if (!recording_ && !capture_.isOpened()) capture_ = open_();
    } catch (const std::runtime_error& error) {
      problem_ = error.what();
      return false;
    }
    if (capture_.read(*bgr) && !bgr->empty()) {
      problem_.clear();
      return true;
    }
    if (!recording_) capture_.release();
    problem_ = "it has ended or gives no frame";
    return false;
  }

  Open open_;
  cv::VideoCapture capture_;
  bool recording_;
  StampClock clock_;
  std::string problem_;
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

/// At a rate and a size that are not below what is published. A driver takes what it has nearest:
/// asked for 20 Hz, that may be 15.
cv::VideoCapture OpenDevice(const CameraConfig& config) {
  const std::string& device = config.source;
  setenv("OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT", "1", 0);  // s that a read may wait
  cv::VideoCapture capture(device, cv::CAP_V4L2);
  if (!capture.isOpened())
    throw std::runtime_error(device +
                             ": camera cannot be opened; check that it is plugged in, that no "
                             "other program holds it and that you are in the group video");
  capture.set(cv::CAP_PROP_BUFFERSIZE, 1);
  // Raw frames of more than 640 x 480 do not pass USB 2 at 30 Hz.
  capture.set(cv::CAP_PROP_FOURCC, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'));
  capture.set(cv::CAP_PROP_FRAME_WIDTH, std::max(config.width_px, 640));
  capture.set(cv::CAP_PROP_FRAME_HEIGHT, std::max(config.height_px, 480));
  capture.set(cv::CAP_PROP_FPS, std::max(config.rate_hz, 30.0));
  return capture;
}

cv::VideoCapture OpenPipeline(const std::string& pipeline) {
  cv::VideoCapture capture(pipeline, cv::CAP_GSTREAMER);
  if (!capture.isOpened())
    throw std::runtime_error("gst:" + pipeline +
                             ": GStreamer cannot play this; try it with gst-launch-1.0, and end it "
                             "in appsink max-buffers=1 drop=true");
  return capture;
}

cv::VideoCapture OpenStream(const std::string& url) {
  const std::vector<int> patience = {cv::CAP_PROP_OPEN_TIMEOUT_MSEC, 5000,
                                     cv::CAP_PROP_READ_TIMEOUT_MSEC, 1000};
  cv::VideoCapture capture(url, cv::CAP_FFMPEG, patience);
  if (!capture.isOpened())
    throw std::runtime_error(url + ": no stream that OpenCV can read; try it with ffplay");
  return capture;
}

cv::VideoCapture OpenFile(const std::string& file) {
  cv::VideoCapture capture(file, cv::CAP_FFMPEG);
  if (!capture.isOpened())
    throw std::runtime_error(file + ": no video that OpenCV can read; convert it to MP4 or AVI");
  return capture;
}

bool BeginsWith(const std::string& text, const char* head) { return text.rfind(head, 0) == 0; }

}  // namespace

std::unique_ptr<FrameSource> OpenFrameSource(const CameraConfig& config) {
  const std::string& source = config.source;
  if (BeginsWith(source, "http://")) return OpenMjpegSource(source);
  const auto live = [](VideoSource::Open open, StampClock clock) {
    return std::make_unique<VideoSource>(std::move(open), false, clock);
  };
  if (BeginsWith(source, "gst:"))
    return live([source] { return OpenPipeline(source.substr(4)); }, StampClock::kStream);
  if (source.find("://") != std::string::npos)
    return live([source] { return OpenStream(source); }, StampClock::kStream);
  const auto status = fs::status(source);
  if (!fs::exists(status))
    throw std::runtime_error(source + ": no such device, file or folder; set source");
  if (fs::is_directory(status)) return OpenFolder(source);
  if (fs::is_character_file(status))
    return live([config] { return OpenDevice(config); }, StampClock::kMonotonic);
  return std::make_unique<VideoSource>([source] { return OpenFile(source); }, true,
                                       StampClock::kNone);
}

}  // namespace chase::camera
