#pragma once

#include "services/perception/finder.h"

namespace chase::perception {

/// Something that may be the target, followed until it is known whether it drives or stands.
struct Candidate {
  TargetTrack track;
  TargetGaussian first;  ///< as it was first known well
  double since = 0.0;    ///< when it was first seen, s
  Sighting last;         ///< the last one
  double px = 0.0;       ///< what one pixel spans there, m

  /// Takes over a sighting at the track's time.
  void Correct(const Sighting& sighting);

  /// True when it has surely moved from where it was first seen.
  bool Drives() const;
};

}  // namespace chase::perception
