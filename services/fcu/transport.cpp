#include "services/fcu/transport.h"

#include <fcntl.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <termios.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <thread>

#include "common/bus/udp_port.h"

namespace chase::fcu {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kPollMs = 100;                // after which the thread looks whether it is to end
constexpr std::size_t kMostWaiting = 4000;  // arrivals: seconds of a busy link
constexpr std::size_t kBufferBytes = 4096;

std::runtime_error Failure(const std::string& what, const std::string& cure) {
  return std::runtime_error(what + ": " + std::strerror(errno) + "; " + cure);
}

/// A file descriptor and the thread that reads from it.
class Reading : public Transport {
 public:
  Reading(int fd, std::string name) : fd_(fd), name_(std::move(name)) {}
  Reading(const Reading&) = delete;
  Reading& operator=(const Reading&) = delete;
  ~Reading() override { close(fd_); }

  std::vector<Arrival> Take() override {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::vector<Arrival> taken;
    for (Waiting& w : waiting_) {
      const auto age = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - w.at);
      taken.push_back({std::move(w.bytes), age.count()});
    }
    waiting_.clear();
    return taken;
  }
  std::string Name() const override { return name_; }
  std::string Problem() const override {
    const std::lock_guard<std::mutex> lock(mutex_);
    return problem_;
  }

 protected:
  void Start() {
    thread_ = std::thread([this] { Run(); });
  }
  /// To be called by the destructors of what overrides Read().
  void Stop() {
    stop_ = true;
    if (thread_.joinable()) thread_.join();
  }
  int fd() const { return fd_; }
  /// As read(2).
  virtual ssize_t Read(uint8_t* buffer, std::size_t size) = 0;

  mutable std::mutex mutex_;

 private:
  struct Waiting {
    std::vector<uint8_t> bytes;
    Clock::time_point at;
  };

  void Run() {
    std::vector<uint8_t> buffer(kBufferBytes);
    while (!stop_) {
      pollfd ready{fd_, POLLIN, 0};
      if (poll(&ready, 1, kPollMs) <= 0) continue;
      const ssize_t size = Read(buffer.data(), buffer.size());
      const auto now = Clock::now();
      const std::lock_guard<std::mutex> lock(mutex_);
      if (size > 0 && waiting_.size() < kMostWaiting)
        waiting_.push_back({{buffer.begin(), buffer.begin() + size}, now});
      const bool broken = size == 0 || (size < 0 && errno != EAGAIN && errno != EINTR);
      if (!broken && (ready.revents & (POLLHUP | POLLNVAL)) == 0) continue;
      problem_ = name_ + (size < 0 ? std::string(": ") + std::strerror(errno) : " has gone");
      return;
    }
  }

  int fd_;
  std::string name_;
  std::atomic<bool> stop_{false};
  std::vector<Waiting> waiting_;
  std::string problem_;
  std::thread thread_;
};

class Udp : public Reading {
 public:
  Udp(int fd, int port) : Reading(fd, "UDP port " + std::to_string(port)) { Start(); }
  ~Udp() override { Stop(); }

  void Send(const std::vector<uint8_t>& bytes) override {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!peer_) return;
    sendto(fd(), bytes.data(), bytes.size(), MSG_DONTWAIT,
           reinterpret_cast<const sockaddr*>(&*peer_), sizeof *peer_);
  }
  void Trust() override {
    const std::lock_guard<std::mutex> lock(mutex_);
    peer_ = last_;
  }
  bool whole() const override { return true; }

 protected:
  ssize_t Read(uint8_t* buffer, std::size_t size) override {
    sockaddr_in from{};
    socklen_t length = sizeof from;
    const ssize_t n =
        recvfrom(fd(), buffer, size, MSG_DONTWAIT, reinterpret_cast<sockaddr*>(&from), &length);
    // An empty datagram, or an error that came back for one that we sent, ends nothing.
    if (n <= 0) {
      errno = EAGAIN;
      return -1;
    }
    const std::lock_guard<std::mutex> lock(mutex_);
    last_ = from;
    return n;
  }

 private:
  std::optional<sockaddr_in> last_, peer_;
};

class Serial : public Reading {
 public:
  Serial(int fd, const std::string& device) : Reading(fd, device) { Start(); }
  ~Serial() override { Stop(); }

  void Send(const std::vector<uint8_t>& bytes) override {
    // Half a frame costs the next one too; a full buffer means that the link is too slow anyway.
    std::size_t at = 0;
    for (int tries = 0; at < bytes.size() && tries < 3; ++tries) {
      const ssize_t n = write(fd(), bytes.data() + at, bytes.size() - at);
      if (n > 0) at += static_cast<std::size_t>(n);
    }
  }
  void Trust() override {}
  bool whole() const override { return false; }

 protected:
  ssize_t Read(uint8_t* buffer, std::size_t size) override { return read(fd(), buffer, size); }
};

std::optional<speed_t> Speed(int baud) {
  switch (baud) {
    case 57600:
      return B57600;
    case 115200:
      return B115200;
    case 230400:
      return B230400;
    case 460800:
      return B460800;
    case 500000:
      return B500000;
    case 921600:
      return B921600;
    case 1000000:
      return B1000000;
    case 1500000:
      return B1500000;
    case 2000000:
      return B2000000;
    case 3000000:
      return B3000000;
    default:
      return std::nullopt;
  }
}

std::unique_ptr<Transport> OpenSerial(const std::string& device, int baud) {
  const std::optional<speed_t> speed = Speed(baud);
  if (!speed)
    throw std::runtime_error("baud " + std::to_string(baud) +
                             " is no rate of serial devices; set 57600, 115200, 460800 or 921600");
  const int fd = open(device.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
  if (fd < 0)
    throw Failure("serial device " + device, "check the wiring, or join the group dialout");
  termios settings{};
  if (tcgetattr(fd, &settings) != 0) {
    const auto failure =
        Failure(device + " is no serial device", "set link to udp or a serial device");
    close(fd);
    throw failure;
  }
  cfmakeraw(&settings);
  settings.c_cflag |= CLOCAL | CREAD;
  settings.c_cflag &= ~static_cast<tcflag_t>(CRTSCTS | CSTOPB);
  cfsetispeed(&settings, *speed);
  cfsetospeed(&settings, *speed);
  tcsetattr(fd, TCSANOW, &settings);
  tcflush(fd, TCIOFLUSH);
  return std::make_unique<Serial>(fd, device);
}

}  // namespace

std::unique_ptr<Transport> OpenTransport(const std::string& link, int port, int baud) {
  if (link == "udp") return std::make_unique<Udp>(bus::OpenUdpPort(port), port);
  return OpenSerial(link, baud);
}

}  // namespace chase::fcu
