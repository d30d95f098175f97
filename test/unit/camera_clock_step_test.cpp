// The host's wall clock is set while a frame that it has stamped is on its way.
#include <arpa/inet.h>
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <thread>
#include <vector>

#include "chase/camera_image_t.hpp"
#include "common/bus/host_clock.h"
#include "common/bus/lockstep.h"
#include "services/camera/camera_node.h"
#include "test/flight/wall_clock.h"

namespace chase::camera {
namespace {

constexpr int64_t kPeriod = 50'000;  // us from frame to frame
constexpr int64_t kDelay = 30'000;   // us from a frame's capture to its sending
constexpr int64_t kStart = 1'000'000;
constexpr int kFrames = 32, kStruck = 5;

/// An MJPEG stream on the loopback, of one client.
class Stream {
 public:
  Stream() : listening_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof address;
    auto* const raw = reinterpret_cast<sockaddr*>(&address);
    EXPECT_EQ(bind(listening_, raw, length) | listen(listening_, 1), 0);
    getsockname(listening_, raw, &length);
    url = fmt::format("http://127.0.0.1:{}/", ntohs(address.sin_port));
    std::vector<uint8_t> jpeg;
    cv::imencode(".jpg", cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(90)), jpeg);
    jpeg_.assign(jpeg.begin(), jpeg.end());
  }
  Stream(const Stream&) = delete;
  Stream& operator=(const Stream&) = delete;
  ~Stream() {
    close(client_);
    close(listening_);
  }
  void Accept() {
    client_ = accept(listening_, nullptr, nullptr);
    Send("HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace;boundary=b\r\n\r\n");
  }
  /// A frame that was taken at `wall`, us since 1970.
  void SendFrame(int64_t wall) {
    Send(fmt::format("--b\r\nX-Timestamp: {}.{:06}\r\nContent-Length: {}\r\n\r\n", wall / 1'000'000,
                     wall % 1'000'000, jpeg_.size()) +
         jpeg_ + "\r\n");
  }
  std::string url;

 private:
  void Send(const std::string& bytes) { send(client_, bytes.data(), bytes.size(), MSG_NOSIGNAL); }
  int listening_, client_ = -1;
  std::string jpeg_;
};

struct Stamps {
  std::vector<int64_t> captured, published;  ///< us, the steady clock
};

/// Frames of a clock that is `ahead` of this host's wall clock, which is set by `step` while frame
/// `kStruck` is on its way, us.
Stamps Film(int64_t ahead, int64_t step) {
  Stream stream;
  CameraConfig config;
  config.source = stream.url;
  config.rate_hz = 1000.0;
  Stamps stamps;
  const int64_t begin = bus::SteadyMicroseconds() - kStart;
  bus::Lockstep lockstep(kStart);
  lockstep.Add("camera", 0,
               [&](bus::Bus& bus) { return std::make_unique<CameraNode>(bus, config); });
  lockstep.SetTap([&](int64_t, const std::string& channel, const bus::Bus::Bytes& bytes) {
    camera_image_t image;
    if (channel == "CAMERA_IMAGE" &&
        image.decode(bytes.data(), 0, static_cast<int>(bytes.size())) > 0)
      stamps.published.push_back(image.utime + begin);
  });
  const auto run = [&](int64_t until) {
    for (int64_t now = 0; (now = bus::SteadyMicroseconds()) < until;) {
      lockstep.RunUntil(now - begin);
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  };
  stream.Accept();
  for (int k = 0; k < kFrames; ++k) {
    stamps.captured.push_back(bus::SteadyMicroseconds());
    const int64_t wall = bus::WallMicroseconds() + ahead - (ahead != 0 && k > kStruck ? step : 0);
    if (k == kStruck) *ChaseClockSteps() = {bus::WallMicroseconds(), step};
    run(stamps.captured.back() + kDelay);
    stream.SendFrame(wall);
    run(stamps.captured.back() + kPeriod);
  }
  run(bus::SteadyMicroseconds() + 2 * kPeriod);
  *ChaseClockSteps() = {};
  return stamps;
}

TEST(CameraNode, StampsDoNotKnowOfTheWallClockThatIsSet) {
  for (const int64_t ahead : {int64_t{0}, int64_t{3'600'000'000}}) {  // of another machine
    for (const int64_t step : {400'000, -400'000, 5'000'000, -5'000'000}) {
      const Stamps stamps = Film(ahead, step);
      EXPECT_EQ(stamps.published.size(), stamps.captured.size()) << step;
      if (stamps.published.size() != stamps.captured.size()) continue;
      // As late as its frames come is what another machine's clock is aligned by.
      const double late = ahead == 0 ? 0.0 : kDelay;
      for (size_t k = 0; k < stamps.captured.size(); ++k)
        EXPECT_NEAR(static_cast<double>(stamps.published[k] - stamps.captured[k]), late, 1e5)
            << k << ", set by " << step << ", another's clock by " << ahead;
    }
  }
}

}  // namespace
}  // namespace chase::camera
