#pragma once

#include "common/world/rig.h"

namespace chase::world {

/// The image's edges as planning asks about them, degrees, less a margin for what calibration, wind
/// and control tilt the body by.
struct ViewAngles {
  double down = 0.0;     ///< the lower edge below the body's level
  double up = 0.0;       ///< the upper edge above it
  double bearing = 0.0;  ///< the sides off the optical axis
};

/// Of a camera without its lens. What looks askew sees less: by its roll and yaw on every side.
ViewAngles ViewOf(const Rig& rig);

}  // namespace chase::world
