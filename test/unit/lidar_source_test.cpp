#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <thread>

#include "lidar_packets.h"
#include "services/lidar/packet_source.h"
#include "services/lidar/pcap_reader.h"
#include "services/lidar/sweep_assembler.h"

namespace chase::lidar {
namespace {

namespace fs = std::filesystem;
using testing::Bytes;
using testing::FreePort;
using testing::StreamPacket;

fs::path Recording(const std::string& name) { return fs::path("../shared/data/vlp16") / name; }

#define NEED(file) \
  if (!fs::exists(file)) GTEST_SKIP() << "skipped: real recordings not present"

struct Decoded {
  long packets = 0, points = 0;
  std::vector<Sweep> sweeps;
  SweepAssembler assembler;
};

Decoded DecodeFile(const fs::path& file) {
  LidarConfig config;
  config.cut_azimuth_deg = -1.0;
  Decoded out{0, 0, {}, SweepAssembler(config)};
  const auto source = OpenPacketSource(file.string(), config.port);
  while (const auto packet = source->Next()) {
    ++out.packets;
    out.points += static_cast<long>(
        Decode(packet->bytes.data(), config.min_range, config.max_range).points.size());
    for (Sweep& s : out.assembler.Add(packet->bytes.data(), packet->bytes.size()))
      out.sweeps.push_back(std::move(s));
  }
  return out;
}

std::string ErrorOf(const std::string& source) {
  try {
    OpenPacketSource(source, 2368);
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "";
}

std::string TempFile(const std::string& name, const std::string& content) {
  const fs::path file = fs::path(::testing::TempDir()) / name;
  std::ofstream(file, std::ios::binary) << content;
  return file.string();
}

TEST(LidarRecordings, RawPacketsGiveThirteenTurns) {
  NEED(Recording("einride_recording.bin"));
  const Decoded d = DecodeFile(Recording("einride_recording.bin"));
  EXPECT_EQ(d.packets, 1000);
  ASSERT_EQ(d.sweeps.size(), 13u);
  EXPECT_EQ(d.assembler.lost(), 0);
  for (const Sweep& s : d.sweeps) {
    EXPECT_GT(s.points.size(), 15000u);
    for (const Point& p : s.points) ASSERT_LT(std::hypot(p.x, p.y, p.z), 12.5);
  }
}

/// The sensor stands still, so the same ray of two turns must meet the same wall.
TEST(LidarRecordings, AStandingSensorSeesTheSameRoomEveryTurn) {
  NEED(Recording("einride_recording.bin"));
  const Decoded d = DecodeFile(Recording("einride_recording.bin"));
  ASSERT_GE(d.sweeps.size(), 13u);
  const auto ranges = [](const Sweep& s) {
    std::vector<double> cells(16 * 360, 0.0);
    for (const Point& p : s.points) {
      const double azimuth = std::atan2(p.y, p.x) * 180 / M_PI + 180.0;
      const auto cell = std::min<size_t>(359, static_cast<size_t>(azimuth));
      cells[p.ring * 360u + cell] = std::hypot(p.x, p.y, p.z);
    }
    return cells;
  };
  const auto a = ranges(d.sweeps[0]), b = ranges(d.sweeps[12]);
  int both = 0, close = 0;
  for (size_t i = 0; i < a.size(); ++i) {
    if (a[i] == 0.0 || b[i] == 0.0) continue;
    ++both;
    close += std::abs(a[i] - b[i]) < 0.1;
  }
  EXPECT_GT(both, 3000);
  EXPECT_GT(close, both * 8 / 10);
}

TEST(LidarRecordings, CapturesWithPositionPacketsDecode) {
  NEED(Recording("mrpt_sample_velodyne_vlp16_gps.pcap"));
  const Decoded gps = DecodeFile(Recording("mrpt_sample_velodyne_vlp16_gps.pcap"));
  EXPECT_EQ(gps.packets, 293);
  EXPECT_EQ(gps.sweeps.size(), 3u);
  const Decoded other = DecodeFile(Recording("rustlidar_velodyne_vlp16.pcap"));
  EXPECT_EQ(other.packets, 84);
  EXPECT_EQ(other.sweeps.size(), 1u);  // 0.11 s
  EXPECT_EQ(other.assembler.model().verdict(), ModelCheck::Verdict::kVlp16);
  EXPECT_GT(other.points, 10000);
}

TEST(LidarRecordings, Hdl32IsRefusedWithTheEvidence) {
  NEED(Recording("mrpt_sample_velodyne_hdl32.pcap"));
  const Decoded d = DecodeFile(Recording("mrpt_sample_velodyne_hdl32.pcap"));
  EXPECT_TRUE(d.sweeps.empty());
  EXPECT_EQ(d.assembler.model().verdict(), ModelCheck::Verdict::kOther);
  EXPECT_NE(d.assembler.model().reason().find("HDL-32E"), std::string::npos);
}

TEST(LidarSource, BadFilesAreRefusedInOneLine) {
  EXPECT_NE(ErrorOf("/nonexistent.bin").find("cannot be opened"), std::string::npos);
  EXPECT_NE(ErrorOf(TempFile("empty.bin", "")).find("empty"), std::string::npos);
  EXPECT_NE(ErrorOf(TempFile("text.bin", "hello")).find("neither"), std::string::npos);
  const Bytes good = StreamPacket(0, 0.0, 0);
  const std::string cut(good.begin(), good.end());
  EXPECT_NE(ErrorOf(TempFile("cut.bin", cut + "x")).find("cut off"), std::string::npos);
  EXPECT_NE(ErrorOf(TempFile("ng.pcap", "\x0a\x0d\x0d\x0a_____")).find("libpcap"),
            std::string::npos);
  const std::string header("\xd4\xc3\xb2\xa1\x02\0\x04\0\0\0\0\0\0\0\0\0\xff\xff\0\0\x01\0\0\0",
                           24);
  EXPECT_NE(ErrorOf(TempFile("none.pcap", header)).find("port 2368"), std::string::npos);
}

TEST(LidarSource, ACaptureCutOffAnywhereNeverReadsBeyondItsEnd) {
  std::string file("\xd4\xc3\xb2\xa1\x02\0\x04\0\0\0\0\0\0\0\0\0\xff\xff\0\0\x01\0\0\0", 24);
  std::string record("\1\0\0\0\2\0\0\0\x2e\0\0\0\x2e\0\0\0", 16);
  std::string frame(14, '\0');
  frame[12] = 8;
  frame += std::string("\x45\0\0\x20\0\0\0\0\x40\x11\0\0\x7f\0\0\1\x7f\0\0\1", 20);
  frame += std::string("\0\1\x09\x40\0\x0c\0\0", 8) + "data";
  file += record + frame;
  const std::vector<uint8_t> bytes(file.begin(), file.end());
  const auto datagrams = ReadPcap(bytes, "x");
  ASSERT_EQ(datagrams.size(), 1u);
  EXPECT_EQ(datagrams[0].port, 2368);
  EXPECT_EQ(datagrams[0].utime, 1000002);
  EXPECT_EQ(datagrams[0].payload.size(), 4u);
  for (size_t n = 24; n < bytes.size(); ++n)
    EXPECT_TRUE(ReadPcap({bytes.begin(), bytes.begin() + static_cast<long>(n)}, "x").empty());
}

/// One datagram of 4 bytes, as Wireshark saves it: section, interface and enhanced packet blocks.
TEST(LidarSource, APcapngCaptureIsRead) {
  const auto block = [](char type, const std::string& body) {
    const std::string padded = body + std::string((4 - body.size() % 4) % 4, '\0');
    const auto size = static_cast<char>(12 + padded.size());
    const std::string length = {size, 0, 0, 0};
    return std::string({type, 0, 0, 0}) + length + padded + length;
  };
  std::string frame(14, '\0');
  frame[12] = 8;
  frame += std::string("\x45\0\0\x20\0\0\0\0\x40\x11\0\0\x7f\0\0\1\x7f\0\0\1", 20);
  frame += std::string("\0\1\x09\x40\0\x0c\0\0", 8) + "data";
  std::string section =
      block(0, std::string("\x4d\x3c\x2b\x1a\1\0\0\0", 8) + std::string(8, '\xff'));
  section.replace(0, 4, "\x0a\x0d\x0d\x0a");
  const std::string interface = block(1, std::string("\1\0\0\0\0\0\0\0", 8));
  // 1000002 us after 1970, on interface 0.
  const std::string head("\0\0\0\0\0\0\0\0\x42\x42\x0f\0\x2e\0\0\0\x2e\0\0\0", 20);
  const std::string file = section + interface + block(6, head + frame);
  ASSERT_TRUE(IsPcap({file.begin(), file.end()}));
  const auto datagrams = ReadPcap({file.begin(), file.end()}, "x");
  ASSERT_EQ(datagrams.size(), 1u);
  EXPECT_EQ(datagrams[0].port, 2368);
  EXPECT_EQ(datagrams[0].utime, 1000002);
  EXPECT_EQ(std::string(datagrams[0].payload.begin(), datagrams[0].payload.end()), "data");
}

TEST(LidarSource, UdpPacketsArriveAndAPortInUseIsRefused) {
  const int port = FreePort();
  const auto source = OpenPacketSource("udp", port);
  EXPECT_FALSE(source->Next());
  const int fd = socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<uint16_t>(port));
  to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const Bytes sent = StreamPacket(0, 0.0, 0);
  const auto send = [&] {
    return sendto(fd, sent.data(), sent.size(), 0, reinterpret_cast<sockaddr*>(&to), sizeof to) ==
           static_cast<ssize_t>(sent.size());
  };
  const auto now = [] {
    const auto wall = std::chrono::system_clock::now().time_since_epoch();
    return std::chrono::duration_cast<std::chrono::microseconds>(wall).count();
  };
  // The kernel begins to stamp a moment after it was asked to; what came before bears the time at
  // which it was fetched.
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  const int64_t before = now();
  ASSERT_TRUE(send());
  const int64_t after = now();
  close(fd);
  std::this_thread::sleep_for(std::chrono::milliseconds(200));  // nobody fetches it
  const auto got = source->Next();
  ASSERT_TRUE(got);
  EXPECT_GE(got->capture_utime, before);
  EXPECT_LE(got->capture_utime, after) << "stamped on arrival, not when fetched";
  EXPECT_TRUE(std::equal(sent.begin(), sent.end(), got->bytes.begin(), got->bytes.end()));
  try {
    OpenPacketSource("udp", port);
    FAIL() << "the port is taken";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find(std::to_string(port)), std::string::npos);
  }
}

}  // namespace
}  // namespace chase::lidar
