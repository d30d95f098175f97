#include "services/simulator/udp_socket.h"

#include <arpa/inet.h>
#include <linux/sockios.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <ctime>
#include <stdexcept>
#include <utility>

#include "common/bus/host_clock.h"
#include "common/bus/udp_port.h"

namespace chase::simulator {
namespace {

constexpr int64_t kForgotten = 5'000'000;  // us without a word

const sockaddr* Raw(const sockaddr_in& address) {
  return reinterpret_cast<const sockaddr*>(&address);
}

uint64_t Key(const sockaddr_in& address) {
  return static_cast<uint64_t>(address.sin_addr.s_addr) << 16 | address.sin_port;
}

/// Microseconds since the kernel took in the datagram that was read last.
int64_t AgeOfLast(int fd) {
  timespec at{};
  if (ioctl(fd, SIOCGSTAMPNS, &at) != 0) return 0;
  const int64_t arrived = int64_t{at.tv_sec} * 1'000'000 + at.tv_nsec / 1000;
  return std::max<int64_t>(0, bus::WallMicroseconds() - arrived);
}

}  // namespace

// Whoever sends to the loopback hears the loopback alone.
UdpSocket::UdpSocket(const std::string& host, int port, int own_port) {
  const in_addr_t ip = inet_addr(host.c_str());
  if (ip == INADDR_NONE)
    throw std::runtime_error("hardware.host " + host + " is no address; write 127.0.0.1");
  to_.sin_family = AF_INET;
  to_.sin_port = htons(static_cast<uint16_t>(port));
  to_.sin_addr.s_addr = ip;
  const bool local = ntohl(ip) >> IN_CLASSA_NSHIFT == IN_LOOPBACKNET;
  fd_ = bus::OpenUdpPort(own_port, local ? INADDR_LOOPBACK : INADDR_ANY);
  AgeOfLast(fd_);  // the kernel keeps stamps from the first question on
}

UdpSocket::~UdpSocket() { close(fd_); }

void UdpSocket::Send(const uint8_t* data, std::size_t size) {
  sendto(fd_, data, size, 0, Raw(to_), sizeof to_);
  for (const auto& [key, peer] : others_)
    if (key != Key(to_)) sendto(fd_, data, size, 0, Raw(peer.address), sizeof peer.address);
}

std::vector<Datagram> UdpSocket::Take(int64_t utime) {
  std::vector<Datagram> taken;
  sockaddr_in from{};
  while (auto datagram = bus::NextDatagram(fd_, &from)) {
    taken.push_back({std::move(*datagram), AgeOfLast(fd_)});
    others_[Key(from)] = {from, utime};
  }
  for (auto peer = others_.begin(); peer != others_.end();)
    peer = utime - peer->second.heard > kForgotten ? others_.erase(peer) : std::next(peer);
  return taken;
}

}  // namespace chase::simulator
