#include "services/lidar/udp_source.h"

#include <sys/socket.h>
#include <unistd.h>

#include <cstring>

#include "common/bus/udp_port.h"

namespace chase::lidar {
namespace {

constexpr int kReceiveBufferBytes = 2 * 1024 * 1024;  // 1.7 s of dual returns

/// When the kernel took the datagram in, microseconds since 1970; 0: it does not say.
int64_t KernelTime(msghdr* message) {
  for (cmsghdr* c = CMSG_FIRSTHDR(message); c != nullptr; c = CMSG_NXTHDR(message, c)) {
    if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_TIMESTAMPNS) continue;
    timespec at{};
    std::memcpy(&at, CMSG_DATA(c), sizeof at);
    return int64_t{at.tv_sec} * 1'000'000 + at.tv_nsec / 1000;
  }
  return 0;
}

class UdpSource : public PacketSource {
 public:
  explicit UdpSource(int fd) : fd_(fd) {}
  UdpSource(const UdpSource&) = delete;
  UdpSource& operator=(const UdpSource&) = delete;
  ~UdpSource() override { close(fd_); }

  std::optional<RawPacket> Next() override {
    uint8_t buffer[2048];
    alignas(cmsghdr) char control[CMSG_SPACE(sizeof(timespec))];
    iovec data{buffer, sizeof buffer};
    msghdr message{};
    message.msg_iov = &data, message.msg_iovlen = 1;
    message.msg_control = control, message.msg_controllen = sizeof control;
    const ssize_t size = recvmsg(fd_, &message, MSG_DONTWAIT);
    if (size < 0) return std::nullopt;
    return RawPacket{{buffer, buffer + size}, KernelTime(&message)};
  }
  bool IsRecording() const override { return false; }

 private:
  int fd_;
};

}  // namespace

std::unique_ptr<PacketSource> OpenUdpSource(int port) {
  const int fd = bus::OpenUdpPort(port, INADDR_ANY, kReceiveBufferBytes);
  const int yes = 1;
  setsockopt(fd, SOL_SOCKET, SO_TIMESTAMPNS, &yes, sizeof yes);
  return std::make_unique<UdpSource>(fd);
}

}  // namespace chase::lidar
