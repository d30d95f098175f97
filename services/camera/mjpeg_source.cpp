#include "services/camera/mjpeg_source.h"

#include <fmt/format.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <deque>
#include <opencv2/imgcodecs.hpp>
#include <regex>
#include <stdexcept>

#include "services/camera/connect.h"
#include "services/camera/multipart.h"

namespace chase::camera {
namespace {

constexpr int kPatienceMs = 1000;
constexpr int kBufferBytes = 1 << 16;

struct Address {
  std::string host, port, path;
};

Address Parse(const std::string& url) {
  std::smatch m;
  static const std::regex form("http://([^/:]+)(?::([0-9]+))?(/.*)?");
  if (!std::regex_match(url, m, form))
    throw std::runtime_error(url + ": not of the form http://HOST:PORT/PATH; set source");
  return {m[1], m[2].matched ? m[2].str() : "80", m[3].matched ? m[3].str() : "/"};
}

class MjpegSource : public FrameSource {
 public:
  explicit MjpegSource(const std::string& url) : url_(url), address_(Parse(url)) {}
  MjpegSource(const MjpegSource&) = delete;
  MjpegSource& operator=(const MjpegSource&) = delete;
  ~MjpegSource() override { Close(); }

  std::optional<Frame> Next() override {
    const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(kPatienceMs);
    while (waiting_.empty()) {
      if (fd_ < 0 && !Connect()) return std::nullopt;
      if (!Read() || std::chrono::steady_clock::now() > until) return std::nullopt;
    }
    const Part part = std::move(waiting_.front());
    waiting_.pop_front();
    Frame frame;
    if (!part.body.empty()) frame.bgr = cv::imdecode(part.body, cv::IMREAD_COLOR);
    const auto stamp = part.headers.find("x-timestamp");
    const double seconds =
        stamp != part.headers.end() ? std::strtod(stamp->second.c_str(), nullptr) : 0.0;
    if (seconds > 0.0 && seconds < 1e11) {
      frame.clock = StampClock::kWall;
      frame.stamp = std::llround(1e6 * seconds);
    }
    return frame;
  }
  bool IsRecording() const override { return false; }
  std::string Problem() const override { return problem_; }

 private:
  bool Connect() {
    addrinfo hints{}, *found = nullptr;
    hints.ai_socktype = SOCK_STREAM;
    if (getaddrinfo(address_.host.c_str(), address_.port.c_str(), &hints, &found) != 0)
      return Fail("no such host");
    std::string why;
    fd_ = ConnectToAny(found, kPatienceMs, &why);
    freeaddrinfo(found);
    if (fd_ < 0) return Fail(why);
    reader_ = {};
    const std::string request =
        "GET " + address_.path + " HTTP/1.0\r\nHost: " + address_.host + "\r\n\r\n";
    return send(fd_, request.data(), request.size(), MSG_NOSIGNAL) > 0 || Fail("it has gone");
  }

  /// Takes in what has come; false: nothing, and after a second without a byte it hangs up.
  bool Read() {
    pollfd ready{fd_, POLLIN, 0};
    const int polled = poll(&ready, 1, kPatienceMs);
    if (polled == 0) return Fail(fmt::format("no byte for {} ms", kPatienceMs));
    if (polled < 0) return false;
    uint8_t buffer[kBufferBytes];
    const ssize_t size = recv(fd_, buffer, sizeof buffer, 0);
    if (size <= 0) return Fail("the stream has ended");
    for (Part& part : reader_.Add(buffer, static_cast<std::size_t>(size)))
      waiting_.push_back(std::move(part));
    if (!reader_.problem().empty()) return Fail(reader_.problem());
    problem_.clear();
    return true;
  }

  bool Fail(const std::string& why) {
    problem_ = url_ + ": " + why;
    Close();
    return false;
  }
  void Close() {
    if (fd_ >= 0) close(fd_);
    fd_ = -1;
  }

  std::string url_;
  Address address_;
  int fd_ = -1;
  MultipartReader reader_;
  std::deque<Part> waiting_;
  std::string problem_;
};

}  // namespace

std::unique_ptr<FrameSource> OpenMjpegSource(const std::string& url) {
  return std::make_unique<MjpegSource>(url);
}

}  // namespace chase::camera
