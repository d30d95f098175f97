#pragma once

#include <string>
#include <vector>

#include "common/world/rig.h"
#include "deploy/calibrate/board.h"
#include "deploy/calibrate/imu_fit.h"

namespace chase::calibrate {

/// What the camera and the gyroscope of a log say of how the vehicle turns before the board.
struct Turns {
  std::vector<Turned> seen;
  std::vector<Gyro> gyro;
  long images = 0;
};

/// Reads CAMERA_IMAGE and IMU from an LCM log. Throws std::runtime_error.
Turns ReadTurns(const std::string& log, const Board& board, const world::Rig& rig);

}  // namespace chase::calibrate
