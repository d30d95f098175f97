#include <gtest/gtest.h>

#include <set>
#include <sstream>

#include "common/mavlink/framing.h"
#include "fcu_random.h"

namespace chase::mavlink {
namespace {

constexpr int64_t kUtime = 1'800'000'000'000'000;

using Bytes = std::vector<uint8_t>;

std::vector<Frame> ReadAll(FrameReader* reader, const Bytes& bytes, std::size_t piece = 1000) {
  std::vector<Frame> frames;
  for (std::size_t i = 0; i < bytes.size(); i += piece)
    reader->Add(kUtime, bytes.data() + i, std::min(piece, bytes.size() - i),
                [&](const Frame& f) { frames.push_back(f); });
  return frames;
}

Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

mav::Heartbeat SomeHeartbeat() {
  mav::Heartbeat m;
  m.custom_mode = 6 << 16;
  m.type = 2, m.autopilot = 12, m.base_mode = 0x81, m.system_status = 4, m.mavlink_version = 3;
  return m;
}

// The rule of mavlink.io/en/guide/serialization.html#crc_extra, from names and types alone.
struct Definition {
  explicit Definition(std::size_t base_length) : base(base_length) {}
  std::size_t base, end = 0, last_size = 8;
  std::string text;
  bool ordered = true;

  template <class T>
  void operator()(const char* field, std::size_t offset, const T& value) {
    Add(field, offset, sizeof value, TypeName(value), 0);
  }
  template <class T, std::size_t N>
  void operator()(const char* field, std::size_t offset, const std::array<T, N>& value) {
    Add(field, offset, sizeof value[0], TypeName(value[0]), N);
  }

 private:
  static const char* TypeName(float) { return "float"; }
  static const char* TypeName(char) { return "char"; }
  template <class T>
  static std::string TypeName(T) {
    return (std::is_signed_v<T> ? "int" : "uint") + std::to_string(8 * sizeof(T)) + "_t";
  }
  void Add(const std::string& field, std::size_t offset, std::size_t size, const std::string& type,
           std::size_t length) {
    ordered = ordered && offset == end;
    end += size * std::max<std::size_t>(1, length);
    if (offset >= base) return;  // an extension
    ordered = ordered && size <= last_size;
    last_size = size;
    text += type + " " + field + " ";
    if (length > 0) text += static_cast<char>(length);
  }
};

TEST(FcuFraming, TablesAgreeWithTheRuleOfCrcExtra) {
  std::set<uint32_t> ids;
  testing::ForEachType([&](auto message) {
    using M = decltype(message);
    Definition d(M::kBaseLength);
    M::Visit(message, d);
    const std::string text = std::string(M::kName) + " " + d.text;
    // FrameChecksum takes a last byte of its own: the text's last one.
    const uint16_t crc = FrameChecksum(reinterpret_cast<const uint8_t*>(text.data()),
                                       text.size() - 1, static_cast<uint8_t>(text.back()));
    EXPECT_EQ((crc & 0xFF) ^ (crc >> 8), ChecksumExtra(M::kId)) << M::kName;
    EXPECT_TRUE(d.ordered) << M::kName;
    EXPECT_EQ(d.end, M::kLength) << M::kName;
    ids.insert(M::kId);
  });
  EXPECT_EQ(ids.size(), testing::kTypes);
}

// From the guide's worked layout: magic, length, flags, flags, sequence, sender, id, payload.
TEST(FcuFraming, HeartbeatByHand) {
  FrameWriter writer(1, 191);
  const Bytes frame = writer.Write(kUtime, SomeHeartbeat());
  const Bytes head = {0xFD, 9, 0, 0, 0, 1, 191, 0, 0, 0, 0, 0, 6, 0, 2, 12, 0x81, 4, 3};
  ASSERT_EQ(frame.size(), head.size() + 2);
  EXPECT_EQ(Bytes(frame.begin(), frame.end() - 2), head);
  EXPECT_EQ(writer.Write(kUtime, SomeHeartbeat())[4], 1) << "frames are numbered";
}

TEST(FcuFraming, ZerosAtTheEndAreCutAndComeBack) {
  FrameWriter writer(1, 1);
  mav::Odometry sent;
  sent.x = 1.5f;
  const Bytes frame = writer.Write(kUtime, sent);
  EXPECT_EQ(frame.size(), 12u + 12u);  // time_usec, x
  FrameReader reader;
  const auto frames = ReadAll(&reader, frame);
  ASSERT_EQ(frames.size(), 1u);
  const auto heard = As<mav::Odometry>(frames[0]);
  ASSERT_TRUE(heard);
  EXPECT_EQ(heard->x, 1.5f);
  EXPECT_EQ(heard->quality, 0);
  EXPECT_EQ(writer.Write(kUtime, mav::Odometry{}).size(), 12u + 1u) << "the first byte stays";
}

TEST(FcuFraming, AnyMessageComesBackFromPiecesOfAnySize) {
  world::Random random(1);
  for (int trial = 0; trial < 300; ++trial) {
    FrameWriter writer(3, 4);
    Bytes bytes;
    std::vector<Payload> sent;
    for (std::size_t i = 0; i < testing::kTypes; ++i)
      testing::WithType(i, [&](auto type) {
        const auto message = testing::RandomMessage<decltype(type)>(&random);
        sent.push_back(ToPayload(message));
        bytes = bytes + writer.Write(kUtime, message);
      });
    FrameReader reader;
    const auto frames = ReadAll(&reader, bytes, 1 + random.Next() % 40);
    ASSERT_EQ(frames.size(), sent.size());
    for (std::size_t i = 0; i < sent.size(); ++i)
      EXPECT_EQ(frames[i].payload.bytes, sent[i].bytes) << i;
    EXPECT_EQ(reader.counters().lost, 0);
  }
}

Bytes Version1(const mav::Heartbeat& message, uint8_t sequence) {
  const Payload payload = ToPayload(message);
  Bytes frame(15);
  frame[0] = 0xFE, frame[1] = 9, frame[2] = sequence, frame[3] = 1, frame[4] = 1;
  std::copy_n(payload.bytes.begin(), 9, frame.begin() + 6);
  const uint16_t crc = FrameChecksum(frame.data() + 1, frame.size() - 1, 50);
  frame.push_back(static_cast<uint8_t>(crc));
  frame.push_back(static_cast<uint8_t>(crc >> 8));
  return frame;
}

TEST(FcuFraming, Version1IsReadBetweenFramesOfVersion2) {
  FrameWriter writer(1, 1);
  FrameReader reader;
  const auto frames =
      ReadAll(&reader, Version1(SomeHeartbeat(), 255) + writer.Write(kUtime, mav::Timesync{}) +
                           Version1(SomeHeartbeat(), 1));
  ASSERT_EQ(frames.size(), 3u);
  EXPECT_EQ(frames[0].version, 1);
  EXPECT_EQ(frames[1].version, 2);
  EXPECT_EQ(As<mav::Heartbeat>(frames[2])->base_mode, 0x81);
  EXPECT_EQ(reader.counters().lost, 0);
}

TEST(FcuFraming, GapsAreCountedPerSystemAndComponent) {
  FrameWriter a(1, 1), b(1, 2), c(9, 1);
  FrameReader reader;
  for (int i = 0; i < 600; ++i) {
    ReadAll(&reader, a.Write(kUtime, SomeHeartbeat()));
    const Bytes dropped = b.Write(kUtime, SomeHeartbeat());
    if (i % 3 != 1) ReadAll(&reader, dropped);
    ReadAll(&reader, c.Write(kUtime, SomeHeartbeat()));
  }
  EXPECT_EQ(reader.counters().lost, 200);
  EXPECT_EQ(reader.lost().at({1, 2}), 200);
  EXPECT_EQ(reader.lost().at({1, 1}), 0);
  FrameWriter begun_anew(9, 1);
  for (int i = 0; i < 88; ++i) c.Write(kUtime, SomeHeartbeat());
  ReadAll(&reader, begun_anew.Write(kUtime, SomeHeartbeat()));
  EXPECT_LE(reader.counters().lost, 200 + 127) << "a restart is no loss of 255 frames";
}

TEST(FcuFraming, UnknownMessagesAreSkippedByTheirLength) {
  FrameWriter writer(1, 1);
  // Id 0xFFFFF0 is no one's; its payload holds what looks like a heartbeat.
  const Bytes inside = Version1(SomeHeartbeat(), 7);
  Bytes unknown = {0xFD, static_cast<uint8_t>(inside.size()), 0, 0, 0, 1, 1, 0xF0, 0xFF, 0xFF};
  unknown = unknown + inside + Bytes{0x12, 0x34};
  writer.Write(kUtime, SomeHeartbeat());  // takes number 0
  FrameReader reader;
  const auto frames = ReadAll(&reader, unknown + writer.Write(kUtime, SomeHeartbeat()));
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].version, 2);
  EXPECT_EQ(reader.counters().unknown, 1);
  EXPECT_EQ(reader.counters().lost, 0) << "an unknown message is not a lost one";
}

TEST(FcuFraming, NoiseAndBrokenFramesCostNoOthers) {
  world::Random random(2);
  int heard = 0, sent = 0;
  FrameReader reader;
  FrameWriter writer(1, 1);
  for (int i = 0; i < 2000; ++i) {
    Bytes noise(random.Next() % 30);
    for (uint8_t& b : noise) b = static_cast<uint8_t>(random.Next() % 0xFD);  // no magic byte
    Bytes broken = writer.Write(kUtime, SomeHeartbeat());
    broken[3 + random.Next() % (broken.size() - 3)] ^= 0x10;
    heard += static_cast<int>(
        ReadAll(&reader, noise + broken + writer.Write(kUtime, SomeHeartbeat())).size());
    ++sent;
    reader.Reset();
  }
  // A flipped id may name no message, and a flipped byte may be a magic one.
  EXPECT_GE(heard, sent * 97 / 100);
  EXPECT_LE(heard, sent) << "a broken frame was believed";
  EXPECT_GT(reader.counters().bad_checksum, sent / 2);
}

TEST(FcuFraming, FlagsThatAreNotUnderstoodAreRefused) {
  FrameWriter writer(1, 1);
  Bytes frame = writer.Write(kUtime, SomeHeartbeat());
  frame[2] = 0x02;
  const uint16_t crc = FrameChecksum(frame.data() + 1, frame.size() - 3, 50);
  frame[frame.size() - 2] = static_cast<uint8_t>(crc);
  frame[frame.size() - 1] = static_cast<uint8_t>(crc >> 8);
  FrameReader reader;
  EXPECT_TRUE(ReadAll(&reader, frame).empty());
}

}  // namespace
}  // namespace chase::mavlink
