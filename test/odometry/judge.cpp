#include "test/odometry/judge.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <stdexcept>
#include <vector>

#include "chase/pose_t.hpp"
#include "chase/truth_t.hpp"
#include "common/bus/convert.h"
#include "common/logs/log_reader.h"
#include "common/logs/message_types.h"
#include "common/math/rotation.h"

namespace chase::odometry::trial {

namespace {

using Eigen::Vector3d;

/// An estimate beside the truth of the same time.
struct Pair {
  double t = 0.0;  // mission time, s
  pose_t estimate;
  Eigen::Isometry3d X_estimate, X_truth;
  Vector3d dv;

  Vector3d Error() const { return X_estimate.translation() - X_truth.translation(); }
  double YawError() const {
    return math::Yaw(Eigen::Quaterniond(X_estimate.linear() * X_truth.linear().transpose()));
  }
};

Eigen::Isometry3d PoseOf(const double (&pos)[3], const double (&orientation)[4]) {
  return Eigen::Translation3d(bus::ToVector(pos)) * bus::ToQuaternion(orientation);
}

template <class T>
std::vector<T> Messages(const std::string& log, const std::string& channel) {
  logs::LogReader reader(log);
  std::vector<T> out;
  T message;
  for (logs::LogEvent e; reader.Next(&e);)
    if (e.channel == channel && logs::DecodeBytes(e.bytes, &message)) out.push_back(message);
  if (out.empty()) throw std::runtime_error(log + ": holds no " + channel);
  return out;
}

double Rms(const std::vector<Pair>& pairs, const std::function<double(const Pair&)>& error) {
  double sum = 0.0;
  for (const Pair& pair : pairs) sum += std::pow(error(pair), 2);
  return std::sqrt(sum / static_cast<double>(pairs.size()));
}

double RmsAfter(const std::vector<Pair>& pairs, const Eigen::Isometry3d& fit) {
  return Rms(pairs, [&](const Pair& p) {
    return (fit * p.X_estimate.translation() - p.X_truth.translation()).norm();
  });
}

Eigen::Isometry3d BestFit(const std::vector<Pair>& pairs) {
  Eigen::Matrix3Xd a(3, pairs.size()), b(3, pairs.size());
  for (size_t i = 0; i < pairs.size(); ++i) {
    a.col(static_cast<long>(i)) = pairs[i].X_estimate.translation();
    b.col(static_cast<long>(i)) = pairs[i].X_truth.translation();
  }
  return Eigen::Isometry3d(Eigen::umeyama(a, b, false));
}

bool Finite(const pose_t& m) {
  const auto finite = [](double x) { return std::isfinite(x); };
  return std::all_of(m.pos, m.pos + 3, finite) && std::all_of(m.vel, m.vel + 3, finite) &&
         std::all_of(m.orientation, m.orientation + 4, finite) &&
         std::all_of(m.covariance, m.covariance + 81, finite) &&
         std::all_of(m.accel, m.accel + 3, finite);
}

/// Normalised squared errors of the position (3 degrees of freedom) and of the yaw (1).
double PositionNees(const Pair& pair) {
  using Covariance = Eigen::Matrix<double, 9, 9, Eigen::RowMajor>;
  const Eigen::Matrix3d P =
      Eigen::Map<const Covariance>(pair.estimate.covariance).topLeftCorner<3, 3>();
  return pair.Error().dot(P.ldlt().solve(pair.Error()));
}
double YawNees(const Pair& pair) {
  return pair.YawError() * pair.YawError() / pair.estimate.covariance[80];
}

/// Once a second: mission time, NEES of position and yaw.
std::string NeesSeries(const std::vector<Pair>& pairs) {
  std::string out;
  double next = pairs.front().t;
  for (const Pair& pair : pairs) {
    if (pair.t < next - 1e-6) continue;
    next += 1.0;
    out += fmt::format("{}[{:.2f},{:.4f},{:.4f}]", out.empty() ? "" : ",", pair.t,
                       PositionNees(pair), YawNees(pair));
  }
  return out;
}

/// Ten times a second, as CSV: the errors (rotation error in W) and what POSE says of them.
void WriteSeries(const std::vector<Pair>& pairs, const std::string& path) {
  std::ofstream out(path);
  out << "t,ex,ey,ez,rx,ry,rz,vx,vy,vz,sx,sy,sz,srx,sry,srz,nees_p,nees_yaw,px,py,pz,wx,wy,wz\n";
  double next = pairs.front().t;
  for (const Pair& pair : pairs) {
    if (pair.t < next - 1e-6) continue;
    next += 0.1;
    const Vector3d e = pair.Error(), p = pair.X_truth.translation();
    const Vector3d r = math::LogSO3(
        Eigen::Quaterniond(pair.X_estimate.linear() * pair.X_truth.linear().transpose()));
    const auto sigma = [&](int i) { return std::sqrt(pair.estimate.covariance[10 * i]); };
    const double* w = pair.estimate.rotation_rate;
    out << fmt::format("{:.3f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.5f},{:.5f},{:.5f},",
                       pair.t, e.x(), e.y(), e.z(), r.x(), r.y(), r.z(), pair.dv.x(), pair.dv.y(),
                       pair.dv.z());
    out << fmt::format("{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.6f},{:.4f},{:.4f},", sigma(0),
                       sigma(1), sigma(2), sigma(6), sigma(7), sigma(8), PositionNees(pair),
                       YawNees(pair));
    out << fmt::format("{:.3f},{:.3f},{:.3f},{:.4f},{:.4f},{:.4f}\n", p.x(), p.y(), p.z(), w[0],
                       w[1], w[2]);
  }
}

/// First mission time from `from` on at which the health is (not) OK; -1: never.
double FirstHealth(const std::vector<Pair>& all, double from, bool ok) {
  for (const Pair& pair : all)
    if (pair.t >= from && (pair.estimate.health == pose_t::HEALTH_OK) == ok) return pair.t;
  return -1.0;
}

/// Truth at `utime`, between two samples on the straight and on the great circle; nothing outside.
bool TruthAt(const std::map<int64_t, truth_t>& truth, int64_t utime, Pair* pair) {
  const auto after = truth.lower_bound(utime);
  if (after == truth.end() || (after == truth.begin() && after->first != utime)) return false;
  const truth_t& b = after->second;
  const truth_t& a = after->first == utime ? b : std::prev(after)->second;
  const double s = after->first == utime ? 0.0
                                         : static_cast<double>(utime - a.utime) /
                                               static_cast<double>(b.utime - a.utime);
  const auto mixed = [s](const double(&x)[3], const double(&y)[3]) {
    return Vector3d((1.0 - s) * bus::ToVector(x) + s * bus::ToVector(y));
  };
  pair->t = (1.0 - s) * a.mission_time + s * b.mission_time;
  pair->X_truth = Eigen::Translation3d(mixed(a.pos, b.pos)) *
                  bus::ToQuaternion(a.orientation).slerp(s, bus::ToQuaternion(b.orientation));
  pair->dv = bus::ToVector(pair->estimate.vel) - mixed(a.vel, b.vel);
  return true;
}

std::vector<Pair> Pairs(const JudgeOptions& options) {
  std::map<int64_t, truth_t> truth;
  for (const truth_t& m : Messages<truth_t>(options.truth, "TRUTH")) truth.emplace(m.utime, m);
  std::vector<Pair> pairs;
  for (const pose_t& m : Messages<pose_t>(options.pose, "POSE")) {
    Pair pair;
    pair.estimate = m;
    if (m.health == pose_t::HEALTH_STARTING || !TruthAt(truth, m.utime, &pair)) continue;
    pair.X_estimate = PoseOf(m.pos, m.orientation);
    pairs.push_back(pair);
  }
  if (pairs.empty()) throw std::runtime_error(options.pose + ": no POSE at a time of TRUTH");
  return pairs;
}

}  // namespace

std::string Judge(const JudgeOptions& options) {
  const std::vector<Pair> all = Pairs(options);
  std::vector<Pair> pairs;
  for (const Pair& pair : all)
    if (pair.t >= options.from && pair.t <= options.until) pairs.push_back(pair);
  if (pairs.empty()) throw std::runtime_error(options.pose + ": nothing in the asked time");
  double worst = 0.0, drift = 0.0, jump = 0.0;
  int correcting = 0, not_ok = 0, lost = 0, bad = 0;
  for (size_t i = 0; i < pairs.size(); ++i) {
    const Pair& p = pairs[i];
    worst = std::max(worst, p.Error().norm());
    drift = std::max(drift, (p.Error() - pairs[0].Error()).norm());
    if (i > 0) jump = std::max(jump, (p.Error() - pairs[i - 1].Error()).norm());
    correcting += p.estimate.correcting;
    not_ok += p.estimate.health != pose_t::HEALTH_OK;
    lost += p.estimate.health == pose_t::HEALTH_LOST;
    bad += Finite(p.estimate) ? 0 : 1;
  }
  const Eigen::Isometry3d first = all.front().X_truth * all.front().X_estimate.inverse();
  std::string out = fmt::format(
      "{{\"ate_m\":{:.4f},\"ate_first_pose_m\":{:.4f},\"ate_best_fit_m\":{:.4f},\"worst_m\":{:.4f},"
      "\"end_z_m\":{:.4f},\"velocity_rms\":{:.4f},\"yaw_end_deg\":{:.4f},\"drift_m\":{:.4f},"
      "\"largest_step_m\":{:.5f},\"poses\":{},\"not_finite\":{},\"not_ok\":{},\"lost\":{},"
      "\"correcting\":{}",
      RmsAfter(pairs, Eigen::Isometry3d::Identity()), RmsAfter(pairs, first),
      RmsAfter(pairs, BestFit(pairs)), worst, pairs.back().Error().z(),
      Rms(pairs, [](const Pair& p) { return p.dv.norm(); }), pairs.back().YawError() * 180.0 / M_PI,
      drift, jump, pairs.size(), bad, not_ok, lost, correcting);
  if (options.fault_at >= 0.0) {
    const double over = options.fault_at + options.fault_length;
    const double said = FirstHealth(all, options.fault_at, false);
    const double well = FirstHealth(all, over, true);
    double on_the_way = 0.0;
    for (const Pair& p : all)
      if (p.t >= options.fault_at) on_the_way = std::max(on_the_way, p.Error().norm());
    out += fmt::format(
        ",\"said_after_s\":{:.3f},\"well_after_s\":{:.3f},\"worst_from_fault_m\":{:.4f}",
        said < 0.0 ? -1.0 : said - options.fault_at, well < 0.0 ? -1.0 : well - over, on_the_way);
  }
  if (!options.series.empty()) WriteSeries(pairs, options.series);
  return out + fmt::format(",\"nees\":[{}]}}", NeesSeries(pairs));
}

}  // namespace chase::odometry::trial
