#include "test/odometry/faults.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>

#include "common/bus/convert.h"
#include "common/world/rig.h"

namespace chase::odometry::trial {

namespace {

constexpr int64_t kSecond = 1000000;  // us
constexpr int64_t kLate = 50000;      // us

void Keep(lidar_scan_t* scan, const std::function<bool(size_t)>& wanted) {
  size_t n = 0;
  for (size_t i = 0; i < static_cast<size_t>(scan->size); ++i) {
    if (!wanted(i)) continue;
    scan->x[n] = scan->x[i], scan->y[n] = scan->y[i], scan->z[n] = scan->z[i];
    scan->t[n] = scan->t[i], scan->intensity[n] = scan->intensity[i], scan->ring[n] = scan->ring[i];
    ++n;
  }
  scan->size = static_cast<int32_t>(n);
  scan->x.resize(n), scan->y.resize(n), scan->z.resize(n), scan->t.resize(n);
  scan->intensity.resize(n), scan->ring.resize(n);
}

}  // namespace

std::vector<std::string> Fault::Names() {
  return {"no_sweeps", "no_imu", "corridor", "dropped", "nan", "stamps"};
}

Fault::Fault(const std::string& name, int64_t at) : name_(name), at_(at) {
  const auto names = Names();
  if (name != "none" && std::find(names.begin(), names.end(), name) == names.end())
    throw std::runtime_error("--fault " + name +
                             ": use no_sweeps, no_imu, corridor, dropped, nan or stamps");
}

int64_t Fault::Duration() const {
  if (name_ == "no_imu") return 3 * kSecond / 10;
  if (name_ == "nan") return kSecond / 10;
  if (name_ == "corridor" || name_ == "dropped") return 3 * kSecond;
  return name_ == "none" ? 0 : kSecond;
}

bool Fault::Pass(int64_t now, imu_t*) const { return name_ != "no_imu" || !Active(now); }

bool Fault::Pass(int64_t now, lidar_scan_t* scan) {
  if (!Active(now)) return true;
  if (name_ == "no_sweeps") return false;
  if (name_ == "corridor") KeepCorridor(scan);
  if (name_ == "dropped") DropSome(scan);
  if (name_ == "nan") {
    for (auto* axis : {&scan->x, &scan->y, &scan->z})
      std::fill(axis->begin(), axis->end(), std::numeric_limits<float>::quiet_NaN());
  }
  if (name_ == "stamps") scan->utime += kLate;
  return true;
}

void Fault::DropSome(lidar_scan_t* scan) {
  Keep(scan, [this](size_t) { return random_.Uniform() > 0.3; });
}

/// Of the hall only the ground and the two long walls are left, as if there were nothing else.
void Fault::KeepCorridor(lidar_scan_t* scan) const {
  const world::Rig rig;
  size_t k = 0;
  Keep(scan, [&](size_t i) {
    const double t = static_cast<double>(scan->utime) + 1e6 * static_cast<double>(scan->t[i]);
    while (k + 2 < truth_.size() && static_cast<double>(truth_[k + 1].utime) <= t) ++k;
    while (k > 0 && static_cast<double>(truth_[k].utime) > t) --k;
    const truth_t &a = truth_[k], &b = truth_[std::min(k + 1, truth_.size() - 1)];
    const double s = b.utime > a.utime ? (t - static_cast<double>(a.utime)) /
                                             static_cast<double>(b.utime - a.utime)
                                       : 0.0;
    const Eigen::Vector3d p =
        bus::ToVector(a.pos) + s * (bus::ToVector(b.pos) - bus::ToVector(a.pos));
    const Eigen::Quaterniond q =
        bus::ToQuaternion(a.orientation).slerp(s, bus::ToQuaternion(b.orientation));
    const Eigen::Vector3d p_B =
        rig.R_BL() * Eigen::Vector3d(scan->x[i], scan->y[i], scan->z[i]) + rig.lidar_position;
    const Eigen::Vector3d p_W = p + q * p_B;
    return std::abs(p_W.y()) > 3.7 || p_W.z() < 0.12;
  });
}

}  // namespace chase::odometry::trial
