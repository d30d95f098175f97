#include "services/simulator/udp_socket.h"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace chase::simulator {
namespace {

constexpr int64_t kForgotten = 5'000'000;  // us without a word

sockaddr_in Address(in_addr_t host, int port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(port));
  address.sin_addr.s_addr = host;
  return address;
}

const sockaddr* Raw(const sockaddr_in& address) {
  return reinterpret_cast<const sockaddr*>(&address);
}

uint64_t Key(const sockaddr_in& address) {
  return static_cast<uint64_t>(address.sin_addr.s_addr) << 16 | address.sin_port;
}

}  // namespace

// Whoever sends to the loopback hears the loopback alone.
UdpSocket::UdpSocket(const std::string& host, int port, int own_port) {
  const in_addr_t ip = inet_addr(host.c_str());
  if (ip == INADDR_NONE)
    throw std::runtime_error("hardware.host " + host + " is no address; write 127.0.0.1");
  fd_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  to_ = Address(ip, port);
  const bool local = ntohl(ip) >> IN_CLASSA_NSHIFT == IN_LOOPBACKNET;
  const sockaddr_in own = Address(htonl(local ? INADDR_LOOPBACK : INADDR_ANY), own_port);
  if (fd_ >= 0 && bind(fd_, Raw(own), sizeof own) == 0) return;
  const std::string why = std::strerror(errno);
  if (fd_ >= 0) close(fd_);
  throw std::runtime_error("UDP port " + std::to_string(own_port) + ": " + why +
                           "; stop the program that holds it or set another port");
}

UdpSocket::~UdpSocket() { close(fd_); }

void UdpSocket::Send(const uint8_t* data, std::size_t size) {
  sendto(fd_, data, size, 0, Raw(to_), sizeof to_);
  for (const auto& [key, peer] : others_)
    if (key != Key(to_)) sendto(fd_, data, size, 0, Raw(peer.address), sizeof peer.address);
}

std::vector<std::vector<uint8_t>> UdpSocket::Take(int64_t utime) {
  std::vector<std::vector<uint8_t>> taken;
  uint8_t buffer[2048];
  sockaddr_in from{};
  socklen_t length = sizeof from;
  ssize_t n = 0;
  while ((n = recvfrom(fd_, buffer, sizeof buffer, 0, reinterpret_cast<sockaddr*>(&from),
                       &length)) >= 0) {
    taken.emplace_back(buffer, buffer + n);
    others_[Key(from)] = {from, utime};
    length = sizeof from;
  }
  for (auto peer = others_.begin(); peer != others_.end();)
    peer = utime - peer->second.heard > kForgotten ? others_.erase(peer) : std::next(peer);
  return taken;
}

}  // namespace chase::simulator
