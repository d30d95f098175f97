#include <algorithm>
#include <cmath>
#include <cstring>
#include <stdexcept>

#include "logs/src/import.h"
#include "logs/src/input.h"
#include "logs/src/output.h"

namespace chase::logs {
namespace {

constexpr size_t kRecordBytes = 8;
constexpr double kUnit = 0.004;  // m
constexpr double kSweepSeconds = 0.1;
constexpr int64_t kSweepUs = 100'000;
constexpr int kRings = 16;

struct Record {
  double x, y, z, t;
  uint8_t intensity, ring;
};

double Coordinate(const uint8_t* p) {
  return kUnit * static_cast<int16_t>(static_cast<uint16_t>(p[0] | p[1] << 8));
}

/// Seconds after the sweep's start: 0 behind the car, half the sweep when facing forward.
double TimeInSweep(double x, double y) {
  const double share = 0.5 * (1.0 - std::atan2(y, x) / M_PI);
  return kSweepSeconds * std::clamp(share, 0.0, 1.0 - 1e-6);
}

Record Parse(const uint8_t* p) {
  Record r{Coordinate(p), Coordinate(p + 2), Coordinate(p + 4), 0.0, p[6], 0};
  r.t = TimeInSweep(r.x, r.y);
  r.ring = static_cast<uint8_t>(kRings - 1 - std::min<int>(p[7], kRings - 1));
  return r;
}

/// Number of records of the frame at `at`; throws when they run past the end.
size_t FrameSize(const std::string& file, const std::vector<uint8_t>& bytes, size_t at, int frame) {
  const std::string where = file + ": frame " + std::to_string(frame);
  if (bytes.size() - at < 4) throw std::runtime_error(where + " is cut off; fetch the file again");
  uint32_t n = 0;
  std::memcpy(&n, bytes.data() + at, 4);
  if ((bytes.size() - at - 4) / kRecordBytes < n)
    throw std::runtime_error(where + " says " + std::to_string(n) +
                             " points, more than the file holds; it is cut off or no 16-ring file");
  return n;
}

}  // namespace

lidar_scan_t KittiScan(const uint8_t* records, size_t count, int64_t utime) {
  std::vector<Record> points(count);
  for (size_t i = 0; i < count; ++i) points[i] = Parse(records + kRecordBytes * i);
  std::stable_sort(points.begin(), points.end(),
                   [](const Record& a, const Record& b) { return a.t < b.t; });
  lidar_scan_t scan{};
  scan.utime = utime;
  scan.size = static_cast<int32_t>(count);
  for (const Record& p : points) {
    scan.x.push_back(static_cast<float>(p.x));
    scan.y.push_back(static_cast<float>(p.y));
    scan.z.push_back(static_cast<float>(p.z));
    scan.t.push_back(static_cast<float>(p.t));
    scan.intensity.push_back(p.intensity);
    scan.ring.push_back(p.ring);
  }
  return scan;
}

int ImportKitti16(const std::string& file, const std::string& out) {
  const std::vector<uint8_t> bytes = ReadInput(file);
  OutputLog log(out);
  int frame = 0;
  for (size_t at = 0; at < bytes.size(); ++frame) {
    const size_t count = FrameSize(file, bytes, at, frame);
    auto scan = KittiScan(bytes.data() + at + 4, count, kSweepUs * frame);
    scan.seq = frame;
    log.Write(scan.utime + kSweepUs, "LIDAR_SCAN", scan);
    at += 4 + kRecordBytes * count;
  }
  log.Close();
  return frame;
}

}  // namespace chase::logs
