#include "test/unit/odometry_kitti.h"

#include <lzma.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>

namespace chase::odometry::test {

namespace {

const char* const kSweepsFile = "kitti/raw_2011_09_26_drive_0005_16ring.bin.xz";
const char* const kReferenceFile = "kitti/raw_2011_09_26_drive_0005_reference_kissicp64ring.txt";

std::vector<uint8_t> Unpacked(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  const std::vector<uint8_t> packed((std::istreambuf_iterator<char>(in)), {});
  std::vector<uint8_t> out(64u << 20);
  uint64_t limit = UINT64_MAX;
  size_t in_pos = 0, out_pos = 0;
  if (lzma_stream_buffer_decode(&limit, 0, nullptr, packed.data(), &in_pos, packed.size(),
                                out.data(), &out_pos, out.size()) != LZMA_OK)
    return {};
  out.resize(out_pos);
  return out;
}

constexpr double kSweep = 0.1;  // s

float TimeOf(double x, double y, const SweepTiming& timing) {
  if (timing.no_time) return static_cast<float>(kSweep);
  const double azimuth = std::atan2(y, x);
  double turned = timing.clockwise ? timing.cut_azimuth - azimuth : azimuth - timing.cut_azimuth;
  turned -= 2.0 * M_PI * std::floor(turned / (2.0 * M_PI));
  return static_cast<float>(kSweep * std::min(turned / (2.0 * M_PI), 1.0 - 1e-6));
}

/// As `chase-log import kitti16` has it: the lowest ring is the first.
SweepPoint PointAt(const uint8_t* record, const SweepTiming& timing) {
  int16_t xyz[3];
  std::memcpy(xyz, record, sizeof xyz);
  SweepPoint point;
  const Eigen::Vector3d p = Eigen::Vector3d(xyz[0], xyz[1], xyz[2]) * 0.004;
  point.p = p.cast<float>();
  point.t = TimeOf(p.x(), p.y(), timing);
  point.intensity = record[6];
  point.ring = static_cast<uint8_t>(15 - std::min<int>(record[7], 15));
  return point;
}

}  // namespace

std::string RecordingsFolder() {
  for (const char* folder : {"../shared/data/", "../../shared/data/"})
    if (std::filesystem::exists(folder)) return folder;
  return "";
}

std::vector<Sweep> LoadKittiSweeps(const SweepTiming& timing) {
  const std::string folder = RecordingsFolder();
  if (folder.empty()) return {};
  const std::vector<uint8_t> bytes = Unpacked(folder + kSweepsFile);
  std::vector<Sweep> sweeps;
  for (size_t at = 0; at + 4 <= bytes.size();) {
    uint32_t n = 0;
    std::memcpy(&n, &bytes[at], 4);
    at += 4;
    if (at + 8 * static_cast<size_t>(n) > bytes.size()) return {};
    Sweep sweep;
    sweep.start = kSweep * static_cast<double>(sweeps.size());
    for (uint32_t i = 0; i < n; ++i, at += 8) sweep.points.push_back(PointAt(&bytes[at], timing));
    std::stable_sort(sweep.points.begin(), sweep.points.end(),
                     [](const SweepPoint& a, const SweepPoint& b) { return a.t < b.t; });
    sweeps.push_back(std::move(sweep));
  }
  return sweeps;
}

std::vector<Pose> LoadKittiReference() {
  std::ifstream in(RecordingsFolder() + kReferenceFile);
  std::vector<Pose> poses;
  double m[12];
  while (in >> m[0]) {
    for (int i = 1; i < 12; ++i) in >> m[i];
    Eigen::Matrix3d R;
    R << m[0], m[1], m[2], m[4], m[5], m[6], m[8], m[9], m[10];
    poses.push_back({Eigen::Quaterniond(R), {m[3], m[7], m[11]}});
  }
  return poses;
}

std::vector<double> ErrorsFromFirstPose(const std::vector<Pose>& estimate,
                                        const std::vector<Pose>& reference) {
  std::vector<double> errors;
  for (size_t i = 0; i < estimate.size() && i < reference.size(); ++i) {
    const Pose a = estimate[0].Inverse() * estimate[i];
    const Pose b = reference[0].Inverse() * reference[i];
    errors.push_back((a.p - b.p).norm());
  }
  return errors;
}

double RootMeanSquare(const std::vector<double>& values) {
  double sum = 0.0;
  for (double value : values) sum += value * value;
  return values.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(values.size()));
}

}  // namespace chase::odometry::test
