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
constexpr int kReopenPolls = 5;             // between two attempts to open a device again
constexpr std::size_t kMostWaiting = 4000;  // arrivals: seconds of a busy link
constexpr std::size_t kBufferBytes = 4096;

std::runtime_error Failure(const std::string& what, const std::string& cure) {
  return std::runtime_error(what + ": " + std::strerror(errno) + "; " + cure);
}

/// A file descriptor and the thread that reads from it, and opens it again once it has broken.
class Reading : public Transport {
 public:
  Reading(int fd, std::string name) : fd_(fd), name_(std::move(name)) {}
  Reading(const Reading&) = delete;
  Reading& operator=(const Reading&) = delete;
  ~Reading() override {
    if (fd_ >= 0) close(fd_);
  }

  std::vector<Arrival> Take() override {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::vector<Arrival> taken;
    for (Waiting& w : waiting_) {
      const auto age = std::chrono::duration_cast<std::chrono::microseconds>(Clock::now() - w.at);
      taken.push_back({std::move(w.bytes), age.count(), w.peer});
    }
    waiting_.clear();
    return taken;
  }
  int64_t dropped() const override { return dropped_; }
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
  /// Negative while it is broken. The thread changes it under the mutex.
  int fd() const { return fd_; }
  /// As read(2); sets `peer` where there may be several.
  virtual ssize_t Read(uint8_t* buffer, std::size_t size, uint64_t* peer) = 0;
  /// A new file descriptor in the place of one that has broken; negative: not now.
  virtual int Open() = 0;

  mutable std::mutex mutex_;
  int64_t dropped_ = 0;  // counted by who sends

 private:
  struct Waiting {
    std::vector<uint8_t> bytes;
    Clock::time_point at;
    uint64_t peer;
  };

  void Run() {
    for (int polls = 0; !stop_; ++polls) {
      if (fd_ >= 0)
        ReadOnce();
      else if (poll(nullptr, 0, kPollMs); polls % kReopenPolls == 0)
        Reopen();
    }
  }

  void ReadOnce() {
    pollfd ready{fd_, POLLIN, 0};
    if (poll(&ready, 1, kPollMs) <= 0) return;
    uint64_t peer = 0;
    const ssize_t size = Read(buffer_.data(), buffer_.size(), &peer);
    const int error = errno;
    const auto now = Clock::now();
    const std::lock_guard<std::mutex> lock(mutex_);
    if (size > 0 && waiting_.size() < kMostWaiting)
      waiting_.push_back({{buffer_.begin(), buffer_.begin() + size}, now, peer});
    const bool broken = size == 0 || (size < 0 && error != EAGAIN && error != EINTR);
    if (!broken && (ready.revents & (POLLHUP | POLLNVAL)) == 0) return;
    problem_ = name_ + (size < 0 ? std::string(": ") + std::strerror(error) : " has gone");
    close(fd_);
    fd_ = -1;
  }

  void Reopen() {
    const int fd = Open();
    const std::lock_guard<std::mutex> lock(mutex_);
    fd_ = fd;
    if (fd >= 0) problem_.clear();
  }

  int fd_;
  std::string name_;
  std::atomic<bool> stop_{false};
  std::vector<uint8_t> buffer_ = std::vector<uint8_t>(kBufferBytes);  // the thread's own
  std::vector<Waiting> waiting_;
  std::string problem_;
  std::thread thread_;
};

class Udp : public Reading {
 public:
  Udp(int fd, int port) : Reading(fd, "UDP port " + std::to_string(port)) { Start(); }
  ~Udp() override { Stop(); }

  void Send(const std::vector<uint8_t>& bytes, uint64_t peer) override {
    if (peer == 0) return;
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = static_cast<in_addr_t>(peer >> 16);
    to.sin_port = static_cast<in_port_t>(peer);
    const std::lock_guard<std::mutex> lock(mutex_);
    if (sendto(fd(), bytes.data(), bytes.size(), MSG_DONTWAIT,
               reinterpret_cast<const sockaddr*>(&to), sizeof to) < 0)
      ++dropped_;
  }
  bool whole() const override { return true; }

 protected:
  ssize_t Read(uint8_t* buffer, std::size_t size, uint64_t* peer) override {
    sockaddr_in from{};
    socklen_t length = sizeof from;
    const ssize_t n =
        recvfrom(fd(), buffer, size, MSG_DONTWAIT, reinterpret_cast<sockaddr*>(&from), &length);
    // An empty datagram, or an error that came back for one that we sent, ends nothing.
    if (n <= 0) {
      errno = EAGAIN;
      return -1;
    }
    *peer = uint64_t{from.sin_addr.s_addr} << 16 | from.sin_port;
    return n;
  }
  int Open() override { return -1; }  // does not break
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

/// A file descriptor of the device, set to raw bytes at `baud`.
int OpenSerial(const std::string& device, int baud) {
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
  return fd;
}

class Serial : public Reading {
 public:
  Serial(const std::string& device, int baud)
      : Reading(OpenSerial(device, baud), device), device_(device), baud_(baud) {
    Start();
  }
  ~Serial() override { Stop(); }

  void Send(const std::vector<uint8_t>& bytes, uint64_t /*peer*/) override {
    const std::lock_guard<std::mutex> lock(mutex_);
    // Half a frame costs the next one too; a full buffer means that the link is too slow anyway.
    std::size_t at = 0;
    for (int tries = 0; at < bytes.size() && tries < 3; ++tries) {
      const ssize_t n = write(fd(), bytes.data() + at, bytes.size() - at);
      if (n > 0) at += static_cast<std::size_t>(n);
    }
    if (at < bytes.size()) ++dropped_;
  }
  bool whole() const override { return false; }

 protected:
  ssize_t Read(uint8_t* buffer, std::size_t size, uint64_t* /*peer*/) override {
    return read(fd(), buffer, size);
  }
  int Open() override {
    try {
      return OpenSerial(device_, baud_);
    } catch (const std::runtime_error&) {
      return -1;
    }
  }

 private:
  std::string device_;
  int baud_;
};

}  // namespace

std::unique_ptr<Transport> OpenTransport(const std::string& link, int port, int baud) {
  if (link == "udp") return std::make_unique<Udp>(bus::OpenUdpPort(port), port);
  return std::make_unique<Serial>(link, baud);
}

}  // namespace chase::fcu
