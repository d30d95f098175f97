#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <tuple>
#include <vector>

/// Message signing of MAVLink 2 (mavlink.io/en/guide/message_signing.html).
namespace chase::mavlink {

inline constexpr std::size_t kSignatureBytes = 13;  // link, time (6), signature (6)

using Key = std::array<uint8_t, 32>;

/// Time on the signature's clock, units of 10 us since 2015, of a utime (microseconds since 1970).
int64_t SignatureTime(int64_t utime);

/// Both ends of a signed link: signs what goes out and refuses what is unsigned, forged or
/// replayed.
class Signing {
 public:
  Signing(const Key& key, uint8_t link) : key_(key), link_(link) {}

  /// Appends the signature to a whole frame whose flags say that it is signed.
  void Sign(int64_t utime, std::vector<uint8_t>* frame);

  enum class Verdict {
    kGenuine,
    kLate,  ///< by our key, but the first one of its link is more than a minute behind our clock
    kRefused,
  };
  /// Is a whole signed frame genuine and newer than all before it of its system, component and
  /// link? A late one may be a recording, or of a sender that does not know the time yet: what we
  /// send sets its clock.
  Verdict Judge(int64_t utime, uint8_t system, uint8_t component, const uint8_t* frame,
                std::size_t size);

 private:
  std::array<uint8_t, 6> Digest(const uint8_t* data, std::size_t size) const;
  int64_t Now(int64_t utime) const;

  Key key_;
  uint8_t link_;
  int64_t newest_ = 0;                                              // time sent or accepted
  std::map<std::tuple<uint8_t, uint8_t, uint8_t>, int64_t> heard_;  // by system, component, link
};

}  // namespace chase::mavlink
