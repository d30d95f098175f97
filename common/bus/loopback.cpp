#include "common/bus/loopback.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <regex>
#include <vector>

namespace chase::bus {

namespace {

constexpr const char* kPrefix = "LOOPBACK_";  // of what older versions sent
constexpr int kAttempts = 10;
constexpr int kWaitMs = 150;

struct Endpoint {
  sockaddr_in address{};
  std::string text;
};

bool Parse(const std::string& url, Endpoint* endpoint) {
  std::smatch match;
  static const std::regex pattern(R"(udpm://([0-9.]*)(?::(\d{1,5}))?(\?.*)?)");
  if (!std::regex_match(url, match, pattern)) return false;
  if (match[2].length() && !match[1].length()) return false;  // LCM takes none or both
  const std::string host = match[1].length() ? match[1].str() : "239.255.76.67";
  const std::string port = match[2].length() ? match[2].str() : "7667";
  endpoint->text = host + ":" + port;
  endpoint->address.sin_family = AF_INET;
  const int number = std::stoi(port);
  endpoint->address.sin_port = htons(static_cast<uint16_t>(number));
  return number > 0 && number <= 65535 &&
         inet_pton(AF_INET, host.c_str(), &endpoint->address.sin_addr) == 1;
}

class Socket {
 public:
  Socket() : fd_(socket(AF_INET, SOCK_DGRAM, 0)) {}
  ~Socket() {
    if (fd_ >= 0) close(fd_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int fd() const { return fd_; }

 private:
  int fd_;
};

/// No LCM message, so that loggers and spies pass over it: LCM's begin with LC02 or LC03.
std::vector<uint8_t> Packet() {
  const std::string text = "chase loopback " + std::to_string(getpid());
  return {text.begin(), text.end()};
}

bool Join(int fd, const Endpoint& group) {
  const int yes = 1;
  setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  sockaddr_in any = group.address;
  any.sin_addr.s_addr = htonl(INADDR_ANY);
  if (bind(fd, reinterpret_cast<const sockaddr*>(&any), sizeof any) != 0) return false;
  ip_mreq request{group.address.sin_addr, {htonl(INADDR_ANY)}};
  return setsockopt(fd, IPPROTO_IP, IP_ADD_MEMBERSHIP, &request, sizeof request) == 0;
}

bool Returns(int receiver, const std::vector<uint8_t>& packet) {
  std::vector<uint8_t> buffer(65536);
  pollfd poller{receiver, POLLIN, 0};
  while (poll(&poller, 1, kWaitMs) > 0) {
    const ssize_t n = recv(receiver, buffer.data(), buffer.size(), 0);
    if (n == static_cast<ssize_t>(packet.size()) &&
        std::equal(packet.begin(), packet.end(), buffer.begin()))
      return true;
  }
  return false;
}

std::string RouteProblem(const Endpoint& group) {
  return fmt::format(
      "{}: no route for multicast ({}); cure: ip link set lo up && ip route add {}/32 dev lo",
      group.text, std::strerror(errno), group.text.substr(0, group.text.find(':')));
}

}  // namespace

bool IsLoopback(const std::string& channel) {
  return channel.rfind(kPrefix, 0) == 0 || channel == "LCM_SELF_TEST";
}

std::string LoopbackProblem(const std::string& url) {
  if (url.rfind("udpm://", 0) != 0) return "";
  Endpoint group;
  if (!Parse(url, &group))
    return fmt::format("--lcm-url {}: not of the form udpm://ADDRESS:PORT?ttl=0", url);
  if (!IN_MULTICAST(ntohl(group.address.sin_addr.s_addr)))
    return fmt::format(
        "--lcm-url {}: no multicast address; cure: use one of 224.0.0.0 to 239.255.255.255, such "
        "as 239.255.76.67",
        url);
  const Socket receiver, sender;
  if (!Join(receiver.fd(), group)) {
    if (errno == EADDRINUSE)
      return fmt::format(
          "{}: the port is in use by a program that does not share it; "
          "choose another with --lcm-url",
          group.text);
    return RouteProblem(group);
  }
  const std::vector<uint8_t> packet = Packet();
  const unsigned char ttl = 0, loop = 1;
  setsockopt(sender.fd(), IPPROTO_IP, IP_MULTICAST_TTL, &ttl, sizeof ttl);
  setsockopt(sender.fd(), IPPROTO_IP, IP_MULTICAST_LOOP, &loop, sizeof loop);
  for (int i = 0; i < kAttempts; ++i) {
    if (sendto(sender.fd(), packet.data(), packet.size(), 0,
               reinterpret_cast<const sockaddr*>(&group.address), sizeof group.address) < 0)
      return RouteProblem(group);
    if (Returns(receiver.fd(), packet)) return "";
  }
  return fmt::format(
      "{}: own messages do not come back; a firewall drops multicast or its route is "
      "missing; cure: run deploy/doctor",
      group.text);
}

}  // namespace chase::bus
