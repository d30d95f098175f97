#pragma once

#include "chase/lidar_scan_t.hpp"
#include "services/lidar/sweep_assembler.h"

namespace chase::lidar {

/// `utime` is the start of the sweep on the host's clock, microseconds.
lidar_scan_t ToMessage(const Sweep& sweep, int64_t utime);

}  // namespace chase::lidar
