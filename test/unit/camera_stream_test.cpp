// Sources that end, stall and send what is no picture.
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <functional>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <stdexcept>
#include <string>
#include <thread>

#include "common/bus/lockstep.h"
#include "services/camera/camera_node.h"
#include "services/camera/connect.h"
#include "services/camera/frame_source.h"
#include "services/camera/grabber.h"

namespace chase::camera {
namespace {

using std::chrono::milliseconds;

const char kStream[] =
    "HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace;boundary=b\r\n\r\n";

std::string Part(const std::string& body) {
  return "--b\r\nContent-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body + "\r\n";
}

std::string Jpeg() {
  std::vector<uint8_t> jpeg;
  cv::imencode(".jpg", cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(90)), jpeg);
  return {jpeg.begin(), jpeg.end()};
}

/// A JPEG whose header claims more pixels than OpenCV reads.
std::string AbsurdJpeg() {
  std::string jpeg = Jpeg();
  const auto at = jpeg.find("\xFF\xC0");
  for (std::size_t k = 5; k < 9; ++k) jpeg[at + k] = '\xFE';
  return jpeg;
}

/// Answers each connection on the loopback by the same bytes and hangs up, or falls silent.
class Server {
 public:
  Server(std::string answer, bool hangs_up)
      : answer_(std::move(answer)), hangs_up_(hangs_up), fd_(socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t length = sizeof address;
    auto* const raw = reinterpret_cast<sockaddr*>(&address);
    if (bind(fd_, raw, length) != 0 || listen(fd_, 8) != 0 || getsockname(fd_, raw, &length) != 0)
      throw std::runtime_error("no port");
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { Run(); });
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  ~Server() {
    shutdown(fd_, SHUT_RDWR);
    thread_.join();
    close(fd_);
    for (const int fd : silent_) close(fd);
  }
  int connections() const { return connections_; }
  std::string Url(const std::string& host = "127.0.0.1") const {
    return "http://" + host + ":" + std::to_string(port_) + "/";
  }

 private:
  void Run() {
    for (int fd = 0; (fd = accept(fd_, nullptr, nullptr)) >= 0;) {
      ++connections_;
      send(fd, answer_.data(), answer_.size(), MSG_NOSIGNAL);
      if (hangs_up_) {
        char request[1024];
        recv(fd, request, sizeof request, 0);  // else closing would be a reset
        close(fd);
      } else {
        silent_.push_back(fd);
      }
    }
  }
  std::string answer_;
  bool hangs_up_;
  int fd_;
  int port_ = 0;
  std::atomic<int> connections_{0};
  std::vector<int> silent_;
  std::thread thread_;
};

template <class F>
bool Within(milliseconds patience, F holds) {
  const auto end = std::chrono::steady_clock::now() + patience;
  while (!holds())
    if (std::chrono::steady_clock::now() > end)
      return false;
    else
      std::this_thread::sleep_for(milliseconds(5));
  return true;
}

class CountingSource : public FrameSource {
 public:
  CountingSource(std::atomic<int>* asked, bool throws) : asked_(asked), throws_(throws) {}
  std::optional<Frame> Next() override {
    ++*asked_;
    if (throws_) throw std::runtime_error("the driver fell over");
    return std::nullopt;
  }
  bool IsRecording() const override { return false; }

 private:
  std::atomic<int>* asked_;
  bool throws_;
};

TEST(Grabber, ASourceThatThrowsIsAProblem) {
  std::atomic<int> asked{0};
  Grabber grabber(std::make_unique<CountingSource>(&asked, true));
  EXPECT_TRUE(Within(milliseconds(2000), [&] { return !grabber.Problem().empty(); }));
  EXPECT_EQ(grabber.Problem(), "the driver fell over");
}

TEST(Grabber, ASourceThatGivesNothingIsAskedAgainInPeace) {
  std::atomic<int> asked{0};
  auto grabber = std::make_unique<Grabber>(std::make_unique<CountingSource>(&asked, false));
  EXPECT_TRUE(Within(milliseconds(3000), [&] { return asked >= 3; })) << "asked again";
  const int before = asked;
  std::this_thread::sleep_for(milliseconds(500));
  EXPECT_LE(asked - before, 3);
  // Just asked: the pause has nearly all of its time to go.
  const int last = asked;
  Within(milliseconds(2000), [&] { return asked > last; });
  const auto begin = std::chrono::steady_clock::now();
  grabber.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, milliseconds(100));
}

TEST(MjpegSource, EmptyBodiesAndAbsurdPicturesDoNoHarm) {
  for (const std::string& bad : {std::string(), std::string("no jpeg"), AbsurdJpeg()}) {
    const Server server(kStream + Part(bad) + Part(Jpeg()), false);
    Grabber grabber(OpenFrameSource({server.Url()}));
    EXPECT_TRUE(Within(milliseconds(3000), [&] { return grabber.Take().has_value(); }));
    EXPECT_EQ(grabber.undecodable(), 1);
  }
}

TEST(MjpegSource, AServerThatRefusesIsNotBesieged) {
  const Server server("HTTP/1.0 404 Not Found\r\n\r\n", true);
  const Grabber grabber(OpenFrameSource({server.Url()}));
  EXPECT_TRUE(Within(milliseconds(3000), [&] { return server.connections() >= 2; }));
  const int before = server.connections();
  std::this_thread::sleep_for(milliseconds(600));
  EXPECT_LE(server.connections() - before, 4);
}

TEST(MjpegSource, AServerThatFallsSilentIsConnectedAgain) {
  const Server server(kStream + Part(Jpeg()), false);
  Grabber grabber(OpenFrameSource({server.Url()}));
  int pictures = 0;
  EXPECT_TRUE(Within(milliseconds(5000), [&] {
    pictures += grabber.Take().has_value();
    return pictures == 2;
  })) << "the second one comes over a connection of its own";
  EXPECT_GE(server.connections(), 2);
}

/// localhost is often ::1 first, where an IPv4 server does not listen.
TEST(ConnectToAny, EveryAddressIsTried) {
  const Server server("", true);
  const std::string port = server.Url().substr(17, server.Url().size() - 18);
  addrinfo *silent = nullptr, *there = nullptr;
  ASSERT_EQ(getaddrinfo("127.0.0.2", port.c_str(), nullptr, &silent), 0);
  ASSERT_EQ(getaddrinfo("127.0.0.1", port.c_str(), nullptr, &there), 0);
  addrinfo first = *silent, second = *there;
  first.ai_next = &second;
  second.ai_next = nullptr;
  std::string why;
  const int fd = ConnectToAny(&first, 1000, &why);
  EXPECT_GE(fd, 0) << why;
  if (fd >= 0) close(fd);
  first.ai_next = nullptr;
  EXPECT_EQ(ConnectToAny(&first, 1000, &why), -1);
  EXPECT_EQ(why, "Connection refused");
  freeaddrinfo(silent);
  freeaddrinfo(there);
}

TEST(MjpegSource, ARefusedConnectionSaysWhy) {
  std::string url;
  {
    const Server server("", true);
    url = server.Url();
  }
  const auto source = OpenFrameSource({url});
  EXPECT_FALSE(source->Next());
  EXPECT_NE(source->Problem().find("Connection refused"), std::string::npos) << source->Problem();
}

TEST(VideoSource, AStreamThatEndedIsOpenedAgain) {
  const auto file = std::filesystem::path(::testing::TempDir()) / "camera_stream.avi";
  {
    cv::VideoWriter writer(file.string(), cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 20.0,
                           {64, 48});
    ASSERT_TRUE(writer.isOpened());
    for (int k = 0; k < 3; ++k) writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(50)));
  }
  const auto source = OpenFrameSource({"file://" + file.string()});
  ASSERT_FALSE(source->IsRecording());
  for (int k = 0; k < 3; ++k) ASSERT_TRUE(source->Next()) << k;
  EXPECT_FALSE(source->Next());
  EXPECT_NE(source->Problem(), "");
  EXPECT_TRUE(source->Next());
  EXPECT_EQ(source->Problem(), "");
  // Gone while it was closed.
  while (source->Next()) continue;
  std::filesystem::rename(file, file.string() + ".gone");
  EXPECT_FALSE(source->Next());
  EXPECT_NE(source->Problem(), "");
  std::filesystem::rename(file.string() + ".gone", file);
  EXPECT_TRUE(source->Next());
}

TEST(CameraNode, WhatIsNoPictureIsCountedAndKeepsNothingAlive) {
  std::string bytes = kStream;
  for (int k = 0; k < 3; ++k) bytes += Part("no jpeg");
  const Server server(bytes, false);
  CameraConfig config;
  config.source = server.Url();
  const bus::Node* node = nullptr;
  bus::Lockstep lockstep(1'000'000);
  lockstep.Add("camera", 0, [&](bus::Bus& bus) {
    auto made = std::make_unique<CameraNode>(bus, config);
    node = made.get();
    return made;
  });
  int64_t until = 1'000'000;
  std::string detail;
  EXPECT_TRUE(Within(milliseconds(5000), [&] {
    lockstep.RunUntil(until += 500'000);
    detail = node->Report().detail;
    return detail.find(", 3 undecodable") != std::string::npos;
  })) << detail;
  EXPECT_EQ(node->Report().state, bus::NodeReport::State::kFailed);
}

}  // namespace
}  // namespace chase::camera
