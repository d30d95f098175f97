#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <map>
#include <random>

#include "common/bus/seal.h"
#include "common/bus/udp_port.h"
#include "services/link/link_config.h"
#include "services/link/link_node.h"
#include "services/link/packet.h"

namespace chase::link {
namespace {

using Generator = std::mt19937_64;

Bytes RandomBytes(size_t size, Generator* draw) {
  Bytes bytes(size);
  for (auto& b : bytes) b = static_cast<uint8_t>((*draw)());
  return bytes;
}

/// Sizes from nothing to several packets.
std::vector<Message> RandomMessages(int n, Generator* draw) {
  std::vector<Message> messages;
  for (int i = 0; i < n; ++i) {
    const size_t size = (*draw)() % ((*draw)() % 4 == 0 ? 9000 : 700);
    Bytes bytes = RandomBytes(size, draw);
    bytes.push_back(static_cast<uint8_t>(i));  // no two are alike
    bytes.push_back(static_cast<uint8_t>(i >> 8));
    messages.push_back({"CHANNEL_" + std::to_string((*draw)() % 9), bytes});
  }
  return messages;
}

std::vector<Bytes> Pack(const std::vector<Message>& messages, int64_t session, Generator* draw) {
  Packer packer(session);
  std::vector<Bytes> packets;
  for (const Message& m : messages) {
    EXPECT_TRUE(packer.Add(m.channel, m.bytes.data(), m.bytes.size()));
    if ((*draw)() % 5 != 0) continue;
    for (auto& packet : packer.Take(false)) packets.push_back(std::move(packet));
  }
  for (auto& packet : packer.Take(false)) packets.push_back(std::move(packet));
  return packets;
}

using Count = std::map<std::pair<std::string, Bytes>, int>;

Count CountOf(const std::vector<Message>& messages) {
  Count count;
  for (const Message& m : messages) ++count[{m.channel, m.bytes}];
  return count;
}

TEST(Packet, AllArriveOverAGoodPath) {
  Generator draw(1);
  const auto messages = RandomMessages(500, &draw);
  Unpacker unpacker;
  std::vector<Message> came;
  for (const auto& packet : Pack(messages, 7, &draw)) {
    EXPECT_LE(packet.size(), Packer::kMostBytes);
    EXPECT_TRUE(unpacker.Take(packet.data(), packet.size(), &came));
  }
  EXPECT_EQ(CountOf(came), CountOf(messages));
  EXPECT_EQ(unpacker.lost(), 0);
}

TEST(Packet, DoubledAndDisorderedPacketsGiveEachMessageOnce) {
  for (uint64_t seed = 1; seed <= 20; ++seed) {
    Generator draw(seed);
    const auto messages = RandomMessages(300, &draw);
    auto packets = Pack(messages, 7, &draw);
    const auto copies = packets;
    packets.insert(packets.end(), copies.begin(), copies.end());
    for (size_t i = 0; i + 8 < packets.size(); i += 8)
      std::shuffle(packets.begin() + static_cast<long>(i),
                   packets.begin() + static_cast<long>(i) + 8, draw);
    Unpacker unpacker;
    std::vector<Message> came;
    // The first packet sets where the count begins.
    for (const auto& packet : packets) unpacker.Take(packet.data(), packet.size(), &came);
    EXPECT_EQ(CountOf(came), CountOf(messages)) << "seed " << seed;
  }
}

TEST(Packet, ALossyPathLosesLittleMoreThanItsShareEvenOfLargeMessages) {
  Generator draw(3);
  std::vector<Message> messages = RandomMessages(4000, &draw);
  int large = 0, came_large = 0;
  for (const auto& m : messages) large += m.bytes.size() > 1300 ? 1 : 0;
  Unpacker unpacker;
  std::vector<Message> came;
  for (const auto& packet : Pack(messages, 7, &draw))
    if (draw() % 50 != 0) unpacker.Take(packet.data(), packet.size(), &came);
  for (const auto& m : came) came_large += m.bytes.size() > 1300 ? 1 : 0;
  ASSERT_GT(large, 500);
  EXPECT_GT(static_cast<double>(came.size()), 0.97 * static_cast<double>(messages.size()));
  EXPECT_GT(came_large, 0.97 * large);
  EXPECT_GT(unpacker.lost(), 0);
}

TEST(Packet, ARecordedSessionIsRefusedOnceANewerOneWasHeard) {
  Generator draw(4);
  const auto old = Pack(RandomMessages(20, &draw), 7, &draw);
  const auto fresh = Pack(RandomMessages(20, &draw), 8, &draw);
  Unpacker unpacker;
  std::vector<Message> came;
  for (const auto& packet : fresh) EXPECT_TRUE(unpacker.Take(packet.data(), packet.size(), &came));
  const size_t n = came.size();
  for (const auto& packet : old) EXPECT_FALSE(unpacker.Take(packet.data(), packet.size(), &came));
  for (const auto& packet : fresh) unpacker.Take(packet.data(), packet.size(), &came);
  EXPECT_EQ(came.size(), n);
}

/// One end of a link and what came to it.
struct End {
  explicit End(int64_t session) : packer(session) {}
  Packer packer;
  Unpacker unpacker;
  std::vector<Message> came;
};

/// Says a word on the link; is it taken?
bool Tell(End* from, End* to) {
  const uint8_t word[] = {1, 2, 3};
  from->packer.Add("COMMAND", word, sizeof word);
  bool taken = true;
  for (const Bytes& packet : from->packer.Take(true)) {
    taken = to->unpacker.Take(packet.data(), packet.size(), &to->came) && taken;
    to->packer.Hear(to->unpacker);
  }
  return taken;
}

TEST(Packet, AnEndThatBeginsAnewWithAnOlderClockIsHeardAgain) {
  End vehicle(1000), ground(2000);
  EXPECT_TRUE(Tell(&vehicle, &ground));
  EXPECT_TRUE(Tell(&ground, &vehicle));
  ground = End(500);
  EXPECT_FALSE(Tell(&ground, &vehicle)) << "it might be a recording";
  EXPECT_TRUE(Tell(&vehicle, &ground)) << "whose packets say what they have heard";
  EXPECT_TRUE(Tell(&ground, &vehicle));
  vehicle = End(10);
  EXPECT_TRUE(Tell(&ground, &vehicle));
  EXPECT_TRUE(Tell(&vehicle, &ground));
  EXPECT_TRUE(Tell(&ground, &vehicle));
}

TEST(Packet, CutPacketsAreRefusedWhole) {
  Generator draw(5);
  const auto packets = Pack(RandomMessages(3, &draw), 7, &draw);
  for (size_t size = 17; size < packets[0].size(); ++size) {
    Unpacker unpacker;
    std::vector<Message> came;
    const bool taken = unpacker.Take(packets[0].data(), size, &came);
    EXPECT_TRUE(taken || came.empty());
  }
}

/// A packet of one record, as packet.h has it.
Bytes OneRecord(uint32_t number, uint32_t message, uint16_t part, uint16_t parts,
                const Bytes& bytes) {
  Bytes packet = {'C', 'H', 'L', '2'};
  const auto put = [&packet](uint64_t value, int size) {
    for (int i = size - 1; i >= 0; --i) packet.push_back(static_cast<uint8_t>(value >> (8 * i)));
  };
  put(7, 8);
  put(0, 8);
  put(number, 4);
  put(message, 4);
  put(part, 2);
  put(parts, 2);
  put(1, 1);
  put(bytes.size(), 2);
  packet.push_back('A');
  packet.insert(packet.end(), bytes.begin(), bytes.end());
  return packet;
}

TEST(Packet, PartsOfAnotherSizeThanTheirsAreRefused) {
  struct Case {
    uint16_t part, parts;
    size_t least, most;
  };
  const size_t whole = Packer::kPartBytes;
  for (const Case& c :
       {Case{0, 1, 0, Packer::kMostBytes}, Case{0, 3, whole, whole}, Case{1, 3, whole, whole},
        Case{2, 3, 1, whole}, Case{3, 3, 2 + whole, 2 + whole}}) {
    for (const size_t size : {size_t{0}, size_t{1}, whole - 1, whole, whole + 1, whole + 2,
                              whole + 3, size_t{65'535}}) {
      Unpacker unpacker;
      std::vector<Message> came;
      const Bytes packet = OneRecord(1, 1, c.part, c.parts, Bytes(size, 0x55));
      EXPECT_EQ(unpacker.Take(packet.data(), packet.size(), &came),
                size >= c.least && size <= c.most)
          << "part " << c.part << " of " << c.parts << ", " << size << " bytes";
    }
  }
}

TEST(Packet, AnOversizedPartIsNotAddedToTheLostOne) {
  Unpacker unpacker;
  std::vector<Message> came;
  const Bytes parity(2 + Packer::kPartBytes, 1);
  for (const Bytes& packet :
       {OneRecord(1, 1, 0, 2, Bytes(60'000, 0x55)), OneRecord(2, 1, 2, 2, parity)})
    unpacker.Take(packet.data(), packet.size(), &came);
  EXPECT_TRUE(came.empty());
}

TEST(Packet, ALostPacketIsCountedAlthoughItsNeighbourCameTwice) {
  Unpacker unpacker;
  std::vector<Message> came;
  const auto take = [&](uint32_t number) {
    const Bytes packet = OneRecord(number, number, 0, 1, {1});
    EXPECT_TRUE(unpacker.Take(packet.data(), packet.size(), &came));
  };
  take(1);
  take(4);  // 2 and 3 are missing
  EXPECT_TRUE(unpacker.advanced());
  for (int i = 0; i < 5; ++i) take(1);
  EXPECT_FALSE(unpacker.advanced());
  EXPECT_EQ(unpacker.lost(), 2);
  take(2);
  EXPECT_FALSE(unpacker.advanced()) << "late";
  EXPECT_EQ(unpacker.lost(), 1);
  take(2);
  EXPECT_EQ(unpacker.lost(), 1);
  EXPECT_EQ(unpacker.packets(), 3);
}

TEST(Packet, WhatIsTooLargeIsNotTaken) {
  Packer packer(1);
  const Bytes huge(300'000);
  EXPECT_FALSE(packer.Add("LIDAR_SCAN", huge.data(), huge.size()));
  EXPECT_FALSE(packer.Add(std::string(65, 'A'), huge.data(), 1));
  EXPECT_TRUE(packer.Take(false).empty());
  EXPECT_EQ(packer.Take(true).size(), 1u);
}

TEST(Heard, WhatWasHeardIsNotNewAgain) {
  bus::Heard heard;
  const auto is_new = [&heard](const char* sender, int64_t start, int32_t seq) {
    return heard.IsNew({0, seq, sender, "", start, {}});
  };
  EXPECT_TRUE(is_new("control", 7, 4));
  EXPECT_TRUE(is_new("control", 7, 6)) << "one was lost";
  for (const int32_t seq : {6, 5, 4, 0}) EXPECT_FALSE(is_new("control", 7, seq)) << seq;
  EXPECT_TRUE(is_new("viewer", 7, 0)) << "each sender counts its own";
  EXPECT_TRUE(is_new("control", 8, 0)) << "and each of its processes";
  EXPECT_FALSE(is_new("control", 7, 6)) << "also after the next one began";
}

TEST(Seal, AnyChangedBitIsNoticed) {
  Generator draw(6);
  bus::Seal::Key key{};
  for (auto& k : key) k = static_cast<uint8_t>(draw());
  const bus::Seal seal(key);
  const Bytes message = RandomBytes(40, &draw);
  Bytes sealed = message;
  seal.Close("PLAN", &sealed);
  ASSERT_EQ(sealed.size(), message.size() + bus::Seal::kTagBytes);
  EXPECT_EQ(seal.Open("PLAN", sealed.data(), sealed.size()), message.size());
  EXPECT_FALSE(seal.Open("POSE", sealed.data(), sealed.size()));
  EXPECT_FALSE(seal.Open("PLAN", message.data(), message.size()));
  EXPECT_FALSE(seal.Open("PLAN", message.data(), 3));
  for (size_t bit = 0; bit < 8 * sealed.size(); ++bit) {
    Bytes changed = sealed;
    changed[bit / 8] = static_cast<uint8_t>(changed[bit / 8] ^ (1 << bit % 8));
    EXPECT_FALSE(seal.Open("PLAN", changed.data(), changed.size())) << "bit " << bit;
  }
  key[31] ^= 1;
  EXPECT_FALSE(bus::Seal(key).Open("PLAN", sealed.data(), sealed.size()));
}

TEST(Link, HeavyMessagesStayAndOnlyCommandsComeBack) {
  for (const char* channel : {"POSE", "PLAN", "FLIGHT_STATE", "CONTROL_STATUS", "COMMAND_ACK"}) {
    EXPECT_TRUE(Leaves(channel, true)) << channel;
    EXPECT_FALSE(Leaves(channel, false)) << channel;
  }
  for (const char* channel : {"LIDAR_SCAN", "CAMERA_IMAGE", "SCAN_REGISTERED", "MAP"}) {
    EXPECT_FALSE(Leaves(channel, true)) << channel;
    EXPECT_FALSE(Leaves(channel, false)) << channel;
  }
  EXPECT_FALSE(Leaves("LINK_STATUS", true)) << "the ground has a link of its own";
  EXPECT_FALSE(Leaves("COMMAND", true));
  EXPECT_TRUE(Leaves("COMMAND", false));
}

/// Carries nothing.
class SilentBus : public bus::Bus {
 public:
  void SubscribeEvery(const EveryHandler& handler) override { say = handler; }
  int64_t Now() const override { return now; }
  EveryHandler say;
  int64_t now = 1'000'000;

 protected:
  void SubscribeRaw(const std::string& /*channel*/, RawHandler /*handler*/) override {}
  void PublishRaw(const std::string& /*channel*/, Bytes /*bytes*/) override {}
};

/// A socket of loopback's, on a port that is free.
class Loopback {
 public:
  ~Loopback() { close(fd_); }
  int port() const {
    sockaddr_in at{};
    socklen_t size = sizeof at;
    getsockname(fd_, reinterpret_cast<sockaddr*>(&at), &size);
    return ntohs(at.sin_port);
  }
  void Send(const Bytes& bytes, int port) const {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<uint16_t>(port));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(
        sendto(fd_, bytes.data(), bytes.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof to),
        static_cast<ssize_t>(bytes.size()));
  }
  int Take() const {
    sockaddr_in from{};
    int n = 0;
    while (bus::NextDatagram(fd_, &from)) ++n;
    return n;
  }

 private:
  int fd_ = bus::OpenUdpPort(0, INADDR_LOOPBACK);
};

TEST(LinkNode, APacketThatIsSentAgainFromElsewhereMovesNoPeer) {
  const std::string key_file = ::testing::TempDir() + "link_test_key";
  std::ofstream(key_file) << std::string(64, '7');
  LinkConfig config;
  config.key_file = key_file;
  config.port = Loopback().port();
  SilentBus bus;
  LinkNode vehicle(bus, config);
  const Loopback ground, thief;
  Packer packer(7);
  const bus::Seal seal = bus::LoadSeal(key_file);
  std::vector<Bytes> sent;
  const auto speak = [&](const Loopback& from) {
    for (Bytes& packet : packer.Take(true)) {
      seal.Close("ground", &packet);
      from.Send(packet, config.port);
      sent.push_back(packet);
    }
  };
  const auto tick = [&] {
    bus.now += 1'000'000;  // it is idle and says so
    vehicle.Tick(bus.now);
    return std::pair(ground.Take(), thief.Take());
  };
  speak(ground);
  EXPECT_EQ(tick(), std::pair(1, 0));
  for (int i = 0; i < 5; ++i) {
    thief.Send(sent[0], config.port);
    EXPECT_EQ(tick(), std::pair(1, 0)) << "recorded";
  }
  EXPECT_NE(vehicle.Report().detail.find("is silent for 5 s"), std::string::npos)
      << vehicle.Report().detail;
  speak(thief);  // the ground station behind another address: it has the key
  EXPECT_EQ(tick(), std::pair(0, 1));
  std::remove(key_file.c_str());
}

TEST(LinkConfig, RefusalsNameTheField) {
  EXPECT_EQ(LinkConfig{}.Problem(), "");
  LinkConfig config;
  config.side = "ground";
  EXPECT_NE(config.Problem().find("peer is empty"), std::string::npos);
  config.peer = "10.0.0.2:7700";
  EXPECT_EQ(config.Problem(), "");
  config.side = "air";
  EXPECT_NE(config.Problem().find("side is 'air'"), std::string::npos);
}

}  // namespace
}  // namespace chase::link
