#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <filesystem>
#include <map>

#include "services/simulator/udp_socket.h"

namespace chase::simulator {
namespace {

constexpr int64_t kStart = 1'700'000'000'000'000;  // us

long OpenFiles() {
  const std::filesystem::directory_iterator files("/proc/self/fd");
  return std::distance(begin(files), end(files));
}

/// The number of the file that is opened next.
int NextFile() {
  const int file = dup(STDIN_FILENO);
  close(file);
  return file;
}

sockaddr_in Bound(int file) {
  sockaddr_in address{};
  socklen_t length = sizeof address;
  EXPECT_EQ(getsockname(file, reinterpret_cast<sockaddr*>(&address), &length), 0);
  return address;
}

TEST(UdpSocket, LeavesNoFileOpenWhenItFails) {
  const long before = OpenFiles();
  EXPECT_THROW(UdpSocket("nowhere", 14540, 0), std::runtime_error);
  {
    const int file = NextFile();
    const UdpSocket first("127.0.0.1", 14540, 0);
    const int taken = ntohs(Bound(file).sin_port);
    EXPECT_THROW(UdpSocket("127.0.0.1", 14540, taken), std::runtime_error);
  }
  EXPECT_EQ(OpenFiles(), before);
}

TEST(UdpSocket, KnowsHowOldADatagramIs) {
  const int file = NextFile();
  UdpSocket socket("127.0.0.1", 14540, 0);
  const sockaddr_in own = Bound(file);
  usleep(100'000);  // Linux begins to stamp datagrams a moment after the first socket asks for it
  const int sender = ::socket(AF_INET, SOCK_DGRAM, 0);
  for (int i = 0; i < 2; ++i)
    sendto(sender, "x", 1, 0, reinterpret_cast<const sockaddr*>(&own), sizeof own);
  close(sender);
  usleep(30'000);
  const auto datagrams = socket.Take(kStart);
  ASSERT_EQ(datagrams.size(), 2u);
  for (const Datagram& datagram : datagrams) EXPECT_GE(datagram.age, 30'000);
}

TEST(UdpSocket, HearsTheLoopbackAloneWhereItSendsThere) {
  const int file = NextFile();
  for (const auto& [host, own] : std::map<const char*, in_addr_t>{{"127.0.0.1", INADDR_LOOPBACK},
                                                                  {"192.0.2.1", INADDR_ANY}}) {
    const UdpSocket socket(host, 14540, 0);
    EXPECT_EQ(ntohl(Bound(file).sin_addr.s_addr), own) << host;
  }
}

}  // namespace
}  // namespace chase::simulator
