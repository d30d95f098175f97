#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace chase::link {

/// One UDP port and one peer.
class PeerSocket {
 public:
  /// `peer`: "ADDRESS:PORT", or empty: whoever is trusted. Throws std::runtime_error, one line with
  /// the cure.
  PeerSocket(int port, const std::string& peer);
  PeerSocket(const PeerSocket&) = delete;
  PeerSocket& operator=(const PeerSocket&) = delete;
  ~PeerSocket();

  /// The next datagram that is there. Empty where it does not come from a named
  /// peer's address.
  std::optional<std::vector<uint8_t>> Next();
  /// Where no peer is named, the sender of the last datagram is it from now on.
  void Trust();
  /// What the path does not take is lost.
  void Send(const std::vector<uint8_t>& bytes);
  bool has_peer() const { return peer_.has_value(); }
  int64_t strangers() const { return strangers_; }

 private:
  int fd_;
  bool named_;
  std::optional<sockaddr_in> peer_;
  sockaddr_in last_{};
  int64_t strangers_ = 0;
};

}  // namespace chase::link
