#pragma once

#include "services/perception/belief/finder.h"

namespace chase::perception {

// What a sighting shows of its thing.

/// LiDAR points on what is surely one thing.
inline constexpr int kClearPoints = 10;

/// Sides that the detection shows and the reading does not take for the target's.
long LeftOut(const Sighting& s);

/// True when nothing of it is left out, nor cut off.
bool AllSeen(const Sighting& s);

/// True when all of it is seen, on its own, and LiDAR points tell where it is.
bool Clear(const Sighting& s);

/// True when the image's border cuts it.
bool LeavesImage(const Detection& d);

}  // namespace chase::perception
