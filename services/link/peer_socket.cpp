#include "services/link/peer_socket.h"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <stdexcept>

#include "common/bus/udp_port.h"

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
  fd_ = bus::OpenUdpPort(port, INADDR_ANY, kReceiveBufferBytes);
}

PeerSocket::~PeerSocket() { close(fd_); }

std::optional<std::vector<uint8_t>> PeerSocket::Next() {
  std::optional<std::vector<uint8_t>> datagram = bus::NextDatagram(fd_, &last_);
  if (datagram && named_ && last_.sin_addr.s_addr != peer_->sin_addr.s_addr) {
    ++strangers_;
    datagram->clear();  // whoever reads counts what it took
  }
  return datagram;
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
