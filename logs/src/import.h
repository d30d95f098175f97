#pragma once

#include <string>
#include <vector>

#include "chase/lidar_scan_t.hpp"

namespace chase::logs {

/// VLP-16 packets (raw or .pcap) to a log of LIDAR_SCAN. Whole turns from the first packet on;
/// stamps are the sensor's time past the hour, or the capture's clock where it has one. Returns the
/// number of sweeps. Throws std::runtime_error with one line; then no file is left.
int ImportVlp16(const std::string& file, const std::string& out);

/// KITTI sweeps reduced to 16 rings (.bin, .bin.xz) to a log of LIDAR_SCAN at 10 Hz from utime 0.
/// Per frame: uint32 n, then n records of int16 x y z in 4 mm, uint8 intensity, uint8 ring from the
/// top; all little endian.
int ImportKitti16(const std::string& file, const std::string& out);

/// One frame's records as a message: points in firing order, ring 0 the lowest. The sensor turns
/// clockwise seen from above and a sweep begins behind the car, so that time follows from azimuth.
lidar_scan_t KittiScan(const uint8_t* records, size_t count, int64_t utime);

}  // namespace chase::logs
