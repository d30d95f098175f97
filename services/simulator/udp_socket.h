#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace chase::simulator {

struct Datagram {
  std::vector<uint8_t> bytes;
  int64_t age = 0;  ///< microseconds since it arrived
};

/// Datagrams to one address and to whoever has written lately.
class UdpSocket {
 public:
  /// `own_port` 0: any; of the loopback alone where `host` is on it. Throws std::runtime_error with
  /// one line that says what and how to mend it.
  UdpSocket(const std::string& host, int port, int own_port);
  ~UdpSocket();
  UdpSocket(const UdpSocket&) = delete;
  UdpSocket& operator=(const UdpSocket&) = delete;

  void Send(const uint8_t* data, std::size_t size);
  /// What has come in, each datagram as a whole; `utime`: now.
  std::vector<Datagram> Take(int64_t utime);

 private:
  struct Peer {
    sockaddr_in address;
    int64_t heard;
  };
  int fd_ = -1;
  sockaddr_in to_{};
  std::map<uint64_t, Peer> others_;  // by address and port
};

}  // namespace chase::simulator
