#include "services/lidar/udp_source.h"

#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace chase::lidar {
namespace {

constexpr int kReceiveBufferBytes = 2 * 1024 * 1024;  // 1.7 s of dual returns

class UdpSource : public PacketSource {
 public:
  explicit UdpSource(int fd) : fd_(fd) {}
  UdpSource(const UdpSource&) = delete;
  UdpSource& operator=(const UdpSource&) = delete;
  ~UdpSource() override { close(fd_); }

  std::optional<RawPacket> Next() override {
    uint8_t buffer[2048];
    const ssize_t size = recv(fd_, buffer, sizeof buffer, MSG_DONTWAIT);
    if (size <= 0) return std::nullopt;
    return RawPacket{{buffer, buffer + size}, 0};
  }
  bool IsRecording() const override { return false; }

 private:
  int fd_;
};

}  // namespace

std::unique_ptr<PacketSource> OpenUdpSource(int port) {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (fd < 0) throw std::runtime_error(std::string("UDP socket: ") + std::strerror(errno));
  auto source = std::make_unique<UdpSource>(fd);
  setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &kReceiveBufferBytes, sizeof kReceiveBufferBytes);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_ANY);
  if (bind(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw std::runtime_error("UDP port " + std::to_string(port) + ": " + std::strerror(errno) +
                             "; stop the program that holds it or set another port");
  return source;
}

}  // namespace chase::lidar
