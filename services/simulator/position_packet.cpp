#include "services/simulator/position_packet.h"

#include <fmt/chrono.h>

#include <algorithm>
#include <string>

namespace chase::simulator {
namespace {

constexpr std::size_t kStampAt = 198, kPulseAt = 202, kSentenceAt = 206;
constexpr uint8_t kLocked = 2;
constexpr int64_t kHour = 3'600'000'000;  // us

/// NMEA 0183's recommended minimum, of the second that began last.
std::string Sentence(int64_t utc_us) {
  const std::tm utc = fmt::gmtime(static_cast<std::time_t>(utc_us / 1'000'000));
  const std::string words = fmt::format(
      "GPRMC,{:%H%M%S}.00,A,0000.0000000,N,00000.0000000,E,0.0,0.0,{:%d%m%y},0.0,E,A", utc, utc);
  unsigned sum = 0;
  for (const char c : words) sum ^= static_cast<unsigned char>(c);
  return fmt::format("${}*{:02X}\r\n", words, sum);
}

}  // namespace

std::array<uint8_t, 512> PositionPacket(int64_t clock_us, bool locked) {
  std::array<uint8_t, 512> bytes{};
  const auto stamp = static_cast<uint32_t>(clock_us % kHour);
  for (std::size_t i = 0; i < 4; ++i) bytes[kStampAt + i] = static_cast<uint8_t>(stamp >> 8 * i);
  if (!locked) return bytes;
  bytes[kPulseAt] = kLocked;
  const std::string sentence = Sentence(clock_us);
  std::copy(sentence.begin(), sentence.end(), bytes.begin() + kSentenceAt);
  return bytes;
}

}  // namespace chase::simulator
