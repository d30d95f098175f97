#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace chase::logs {

/// A moment of a flight that one wants to see.
struct Moment {
  double t = 0.0;  ///< s
  std::string label;
  int rank = 0;  ///< of several at once, and of too many, those with the least stay
};

/// The moments that a time line's spans {lane, label, from, to} tell of: faults, changes of the
/// flight's state, finds and losses of the target, losses of the pose, verdicts that follow no
/// target, the middle, the end; and `others`. At most 12, in order of time, none within a second of
/// another.
std::vector<Moment> KeyMoments(const nlohmann::ordered_json& spans, std::vector<Moment> others);

/// The camera's image at each moment, the first one from then on, with the target's box in it:
/// {t, label, width, height, jpeg (base64), box [u v w h], state}. Moments without an image within
/// a second are left out. `origin`: utime of t = 0.
nlohmann::ordered_json ImagesAt(const std::string& log, int64_t origin,
                                const std::vector<Moment>& moments);

}  // namespace chase::logs
