#include <gtest/gtest.h>

#include "common/mavlink/framing.h"
#include "common/mavlink/signing.h"
#include "common/world/random.h"
#include "services/fcu/bridge.h"

namespace chase::mavlink {
namespace {

constexpr int64_t kUtime = 1'800'000'000'000'000;
constexpr int64_t kSecond = 1'000'000;

using Bytes = std::vector<uint8_t>;

Key KeyOf(uint8_t first) {
  Key key{};
  key[0] = first;
  return key;
}

struct Receiver {
  explicit Receiver(const Key& key = KeyOf(1)) : signing(key, 0), reader(&signing) {}
  bool Hears(const Bytes& bytes, int64_t utime = kUtime) {
    bool heard = false;
    reader.Add(utime, bytes.data(), bytes.size(), [&](const Frame&) { heard = true; });
    return heard;
  }
  Signing signing;
  FrameReader reader;
};

struct Sender {
  explicit Sender(uint8_t link = 1, const Key& key = KeyOf(1))
      : signing(key, link), writer(1, 1, &signing) {}
  Bytes Send(int64_t utime = kUtime) { return writer.Write(utime, mav::Timesync{1, 2, 0, 0}); }
  Signing signing;
  FrameWriter writer;
};

TEST(FcuSigning, GenuineFramesAreHeardOnceEach) {
  Sender sender;
  Receiver receiver;
  for (int i = 0; i < 600; ++i) {
    const Bytes frame = sender.Send(kUtime + i);  // many within one tick of 10 us
    EXPECT_TRUE(receiver.Hears(frame));
    EXPECT_FALSE(receiver.Hears(frame)) << "replayed";
  }
  EXPECT_EQ(receiver.reader.counters().refused, 600);
}

TEST(FcuSigning, ForgedAndUnsignedFramesAreRefused) {
  world::Random random(3);
  Sender sender, stranger(1, KeyOf(2));
  Receiver receiver;
  EXPECT_FALSE(receiver.Hears(stranger.Send()));
  FrameWriter plain(1, 1);
  EXPECT_FALSE(receiver.Hears(plain.Write(kUtime, mav::Timesync{})));
  for (int i = 0; i < 500; ++i) {
    Bytes frame = sender.Send();
    frame[frame.size() - 1 - random.Next() % kSignatureBytes] ^=
        static_cast<uint8_t>(1 + random.Next() % 255);
    EXPECT_FALSE(receiver.Hears(frame));
    receiver.reader.Reset();
  }
  EXPECT_TRUE(receiver.Hears(sender.Send()));
}

TEST(FcuSigning, AnOldRecordingIsRefusedOnANewLink) {
  Receiver receiver;
  EXPECT_FALSE(receiver.Hears(Sender(5).Send(kUtime - 61 * kSecond)));
  EXPECT_TRUE(receiver.Hears(Sender(5).Send(kUtime - 59 * kSecond)));
  EXPECT_TRUE(receiver.Hears(Sender(6).Send(kUtime + 3600 * kSecond))) << "their clock leads";
  EXPECT_FALSE(receiver.Hears(Sender(7).Send(kUtime))) << "ours has followed it";
}

TEST(FcuSigning, OurOwnClockMayBeSetBack) {
  Sender sender;
  Receiver receiver;
  EXPECT_TRUE(receiver.Hears(sender.Send(kUtime)));
  EXPECT_TRUE(receiver.Hears(sender.Send(kUtime - 3600 * kSecond)));
}

TEST(FcuSigning, LinksAreCountedApart) {
  Sender a(1), b(2);
  Receiver receiver;
  const Bytes early = a.Send(kUtime);
  EXPECT_TRUE(receiver.Hears(b.Send(kUtime + kSecond)));
  EXPECT_TRUE(receiver.Hears(early));
}

// It has no clock: it begins at the time that it stored last.
TEST(FcuSigning, ASignedLinkComesAboutWithAPx4ThatDoesNotKnowTheTime) {
  const Key key = KeyOf(1);
  fcu::Bridge bridge(fcu::FcuConfig{}, key);
  Signing signing(key, 3);
  FrameReader reader(&signing);
  FrameWriter writer(1, 1, &signing);
  mav::Heartbeat beat;
  beat.autopilot = 12;
  int64_t now = kUtime, stored = now - 86'400'000'000;
  int heard = 0;
  for (int i = 0; i < 500; ++i, now += 10'000, stored += 10'000) {
    if (i % 100 == 50) {
      const auto bytes = writer.Write(stored, beat);
      bridge.Receive(now, now, bytes.data(), bytes.size(), true, 7);
      EXPECT_EQ(bridge.autopilot().known(), i > 50) << "not believed before it knows the time";
    }
    bridge.Tick(now);
    for (const auto& bytes : bridge.TakeOutgoing())
      if (bridge.peer() == 7)
        reader.Add(stored, bytes.data(), bytes.size(), [&](const Frame&) { ++heard; });
  }
  EXPECT_GT(heard, 10);
  EXPECT_TRUE(bridge.heard());
}

}  // namespace
}  // namespace chase::mavlink
