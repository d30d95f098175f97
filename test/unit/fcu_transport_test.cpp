// The wire alone: a serial device that is pulled out, on pseudo-terminals.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <thread>

#include "services/fcu/transport.h"

namespace chase::fcu {
namespace {

using Bytes = std::vector<uint8_t>;

bool Within(double seconds, const std::function<bool()>& holds) {
  for (int i = 0; i < 100 * seconds; ++i) {
    if (holds()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return holds();
}

/// The autopilot's end of a line, plugged in under the name `link`.
class Plugged {
 public:
  explicit Plugged(const std::filesystem::path& link)
      : link_(link), fd_(posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)) {
    grantpt(fd_);
    unlockpt(fd_);
    std::filesystem::create_symlink(ptsname(fd_), link_);
  }
  ~Plugged() {
    std::filesystem::remove(link_);
    close(fd_);
  }
  void Send(const Bytes& bytes) {
    ASSERT_EQ(write(fd_, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
  }
  Bytes Take() {
    Bytes bytes(64);
    const ssize_t n = read(fd_, bytes.data(), bytes.size());
    bytes.resize(n > 0 ? static_cast<std::size_t>(n) : 0);
    return bytes;
  }

 private:
  std::filesystem::path link_;
  int fd_;
};

TEST(FcuTransport, WhatIsNotSentWholeIsCounted) {
  char folder[] = "/tmp/chase-fcu-XXXXXX";
  ASSERT_NE(mkdtemp(folder), nullptr);
  const std::filesystem::path device = std::filesystem::path(folder) / "tty";
  {
    const Plugged plugged(device);
    const auto line = OpenTransport(device, 0, 921600);
    line->Send({1}, 0);
    EXPECT_EQ(line->dropped(), 0);
    const Bytes much(1'000'000);  // nobody reads
    line->Send(much, 0);
    EXPECT_EQ(line->dropped(), 1);
  }
  std::filesystem::remove_all(folder);

  const auto udp = OpenTransport("udp", 0, 0);
  udp->Send({1}, 0);
  EXPECT_EQ(udp->dropped(), 0) << "there is no peer";
  udp->Send(Bytes(100'000), uint64_t{htonl(INADDR_LOOPBACK)} << 16 | htons(9));
  EXPECT_EQ(udp->dropped(), 1) << "more than a datagram holds";
}

TEST(FcuTransport, ADeviceThatWentAwayIsOpenedAgain) {
  char folder[] = "/tmp/chase-fcu-XXXXXX";
  ASSERT_NE(mkdtemp(folder), nullptr);
  const std::filesystem::path device = std::filesystem::path(folder) / "tty";
  auto plugged = std::make_unique<Plugged>(device);
  const auto line = OpenTransport(device, 0, 921600);
  const auto passes = [&] {
    plugged->Send({1, 2, 3});
    line->Send({4, 5}, 0);
    return Within(2.0,
                  [&] {
                    const auto taken = line->Take();
                    return !taken.empty() && taken[0].bytes == Bytes{1, 2, 3};
                  }) &&
           Within(2.0, [&] {
             return plugged->Take() == Bytes{4, 5};
           });
  };
  EXPECT_TRUE(passes());
  plugged.reset();
  EXPECT_TRUE(Within(2.0, [&] { return !line->Problem().empty(); }));
  EXPECT_EQ(line->Problem().rfind(device.string(), 0), 0u) << line->Problem();
  line->Send({6}, 0);  // nobody's
  plugged = std::make_unique<Plugged>(device);
  EXPECT_TRUE(Within(3.0, [&] { return line->Problem().empty(); })) << line->Problem();
  EXPECT_TRUE(passes());
  plugged.reset();
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace chase::fcu
