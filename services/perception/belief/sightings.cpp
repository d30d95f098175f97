#include "services/perception/belief/sightings.h"

#include <algorithm>

namespace chase::perception {

long LeftOut(const Sighting& s) {
  long count = 0;
  for (size_t side = 0; side < 4; ++side)
    count += !s.fit.used[side] && !s.detection.silhouette.samples[side].empty();
  return count;
}

bool LeavesImage(const Detection& d) {
  for (size_t side = 0; side < 4; ++side)
    if (d.cut[side] && !d.goes_on[side]) return true;
  return false;
}

bool AllSeen(const Sighting& s) {
  const auto& used = s.fit.used;
  const bool all = std::all_of(used.begin(), used.end(), [](bool side) { return side; });
  return s.fit.whole && (all || s.detection.p_CT);
}

bool Clear(const Sighting& s) {
  const Detection& d = s.detection;
  return s.fit.whole && s.fit.n_points >= kClearPoints && !d.part && !d.edged && !d.AnyCut();
}

}  // namespace chase::perception
