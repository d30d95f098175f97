#include "common/world/view_angles.h"

#include <algorithm>
#include <cmath>

namespace chase::world {

ViewAngles ViewOf(const Rig& rig) {
  constexpr double kMargin = 3.0, deg = 180.0 / M_PI;
  // Two turns move a direction by both angles at the most.
  const double askew = std::abs(rig.camera_roll_deg) + std::abs(rig.camera_yaw_deg);
  const auto angle = [&](double px) {
    return std::atan(px / rig.focal_px) * deg - kMargin - askew;
  };
  return {angle(rig.height_px - 1 - rig.center_v_px) + rig.camera_pitch_deg,
          angle(rig.center_v_px) - rig.camera_pitch_deg,
          angle(std::min(rig.center_u_px, rig.width_px - 1 - rig.center_u_px))};
}

}  // namespace chase::world
