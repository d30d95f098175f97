#include "services/link/peer_socket.h"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace chase::link {
namespace {

constexpr int kReceiveBufferBytes = 1 << 20;  // a second of all that is light

sockaddr_in PeerOf(const std::string& text) {
  const size_t colon = text.rfind(':');
  sockaddr_in peer{};
  peer.sin_family = AF_INET;
  int port = 0;
  try {
    size_t used = 0;
    const std::string digits = colon == std::string::npos ? "" : text.substr(colon + 1);
    port = std::stoi(digits, &used);
    if (used != digits.size()) port = 0;
  } catch (const std::exception&) {
    port = 0;
  }
  if (port < 1 || port > 65535 ||
      inet_pton(AF_INET, text.substr(0, colon).c_str(), &peer.sin_addr) != 1)
    throw std::runtime_error("peer is '" + text + "'; it must be ADDRESS:PORT, as 10.0.0.2:7700");
  peer.sin_port = htons(static_cast<uint16_t>(port));
  return peer;
}

}  // namespace

PeerSocket::PeerSocket(int port, const std::string& peer) : fd_(-1), named_(!peer.empty()) {
  if (named_) peer_ = PeerOf(peer);
  fd_ = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd_ < 0) throw std::runtime_error(std::string("UDP socket: ") + std::strerror(errno));
  setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &kReceiveBufferBytes, sizeof kReceiveBufferBytes);
  sockaddr_in own{};
  own.sin_family = AF_INET;
  own.sin_port = htons(static_cast<uint16_t>(port));
  own.sin_addr.s_addr = htonl(INADDR_ANY);
  if (bind(fd_, reinterpret_cast<const sockaddr*>(&own), sizeof own) == 0) return;
  const std::string why = std::strerror(errno);
  close(fd_);
  throw std::runtime_error("UDP port " + std::to_string(port) + ": " + why +
                           "; stop the program that holds it or set another port");
}

PeerSocket::~PeerSocket() { close(fd_); }

std::optional<std::vector<uint8_t>> PeerSocket::Next() {
  std::array<uint8_t, 2048> buffer{};
  for (;;) {
    socklen_t length = sizeof last_;
    const ssize_t size = recvfrom(fd_, buffer.data(), buffer.size(), 0,
                                  reinterpret_cast<sockaddr*>(&last_), &length);
    if (size < 0) {
      if (errno == EINTR || errno == ECONNREFUSED) continue;  // came back for what we sent
      return std::nullopt;
    }
    if (!named_ || last_.sin_addr.s_addr == peer_->sin_addr.s_addr)
      return std::vector<uint8_t>(buffer.begin(), buffer.begin() + size);
    ++strangers_;
    return std::vector<uint8_t>();  // whoever reads counts what it took
  }
}

void PeerSocket::Trust() {
  if (!named_) peer_ = last_;
}

void PeerSocket::Send(const std::vector<uint8_t>& bytes) {
  if (!peer_) return;
  sendto(fd_, bytes.data(), bytes.size(), MSG_DONTWAIT, reinterpret_cast<const sockaddr*>(&*peer_),
         sizeof *peer_);
}

}  // namespace chase::link
