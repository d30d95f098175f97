#include "common/bus/udp_port.h"

#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>

namespace chase::bus {

int OpenUdpPort(int port, in_addr_t address, int receive_bytes) {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0)
    throw std::runtime_error(std::string("UDP socket: ") + std::strerror(errno) +
                             "; raise the limit on open files");
  if (receive_bytes > 0)
    setsockopt(fd, SOL_SOCKET, SO_RCVBUF, &receive_bytes, sizeof receive_bytes);
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_port = htons(static_cast<uint16_t>(port));
  own.sin_addr.s_addr = htonl(address);
  if (bind(fd, reinterpret_cast<const sockaddr*>(&own), sizeof own) == 0) return fd;
  const std::string why = std::strerror(errno);
  close(fd);
  throw std::runtime_error("UDP port " + std::to_string(port) + ": " + why +
                           "; stop the program that holds it or set another port");
}

std::optional<std::vector<uint8_t>> NextDatagram(int fd, sockaddr_in* from) {
  std::array<uint8_t, 2048> buffer{};
  for (;;) {
    socklen_t length = sizeof *from;
    const ssize_t size = recvfrom(fd, buffer.data(), buffer.size(), MSG_DONTWAIT,
                                  reinterpret_cast<sockaddr*>(from), &length);
    if (size >= 0) return std::vector<uint8_t>(buffer.begin(), buffer.begin() + size);
    if (errno != EINTR && errno != ECONNREFUSED) return std::nullopt;  // came back for what we sent
  }
}

}  // namespace chase::bus
