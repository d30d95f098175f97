#pragma once

#include <cmath>
#include <fstream>
#include <map>
#include <sstream>
#include <string>

#include "chase/event_t.hpp"
#include "chase/obstacles_t.hpp"
#include "chase/plan_t.hpp"
#include "chase/pose_t.hpp"
#include "chase/prediction_t.hpp"
#include "chase/scenario_t.hpp"
#include "chase/status_t.hpp"
#include "chase/target_t.hpp"
#include "chase/truth_t.hpp"
#include "common/bus/convert.h"
#include "common/world/scenario.h"
#include "logs/src/output.h"

/// Writes a log as a flight would, without flying: the target drives its scenario's path and the
/// chaser follows where the target was a while ago. Figures that follow from this are known.
namespace chase::logs::testing {

inline std::string ReadText(const std::string& file) {
  std::ifstream in(file);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

struct SyntheticFlight {
  double lag_s = 2.5;           // the chaser is where the target was then
  double height = 1.4;          // of the chaser, m
  double odometry_error = 0.1;  // constant offset of POSE along x, m
  double target_error = 0.05;   // constant offset of TARGET along y, m
  double wall_factor = 1.0;     // seconds of the log's stamps per logical second
  int64_t start_utime = 1'000'000;
  int64_t clock_step = 0;  // by which all clocks are set at 6 s, us
};

class SyntheticLog {
 public:
  SyntheticLog(const std::string& file, const std::string& yaml, const SyntheticFlight& flight)
      : flight_(flight), scenario_(world::ParseScenario(yaml, "test")), out_(file) {
    motion_ = world::TargetMotion(scenario_);
    origin_ = flight.start_utime + std::llround(scenario_.settle_s * 1e6);
    WriteScenario(yaml);
    const int end = static_cast<int>(std::lround(scenario_.duration_s * 200.0));
    for (int k = static_cast<int>(-scenario_.settle_s * 200.0); k <= end; ++k) WriteAt(k);
    WriteStatus("planning", "plan", 18.0, 12.5);
    WriteStatus("prediction", "predict", 4.0, 3.5);
    WriteStatus("odometry", "match", 30.0, 21.0);
    WriteStatus("mapping", "insert", 25.0, 9.0);
    WriteStatus("simulator", "lidar", 3.0, 18.0);
    out_.Close();
  }

 private:
  using V = Eigen::Vector3d;

  V Target(double t) const {
    const double s = std::max(0.0, t);
    const Eigen::Vector2d p = motion_.Position(s);
    return {p.x(), p.y(), scenario_.target.base + 0.5 * scenario_.target.height};
  }
  V Chaser(double t) const {
    const V p = Target(t - flight_.lag_s);
    return {p.x() + (t < flight_.lag_s ? -0.8 * (flight_.lag_s - std::max(0.0, t)) : 0.0), p.y(),
            flight_.height};
  }

  int64_t Utime(double t) const {
    return origin_ + std::llround(t * 1e6) + (t >= 6.0 ? flight_.clock_step : 0);
  }

  template <class T>
  void Put(const std::string& channel, T m, double t) {
    m.utime = Utime(t);
    m.seq = seqs_[channel]++;
    const double stamp = static_cast<double>(m.utime - flight_.start_utime) * flight_.wall_factor;
    out_.Write(flight_.start_utime + std::llround(stamp), channel, m);
  }

  void WriteScenario(const std::string& yaml) {
    scenario_t m{};
    m.seed = 7;
    m.start_utime = origin_;
    m.name = scenario_.name;
    m.yaml = yaml;
    Put("SCENARIO", m, -scenario_.settle_s);
  }

  void WriteAt(int k) {
    const double t = k / 200.0;
    WritePose(t);
    if (k % 2 == 0) WriteTruth(t);
    if (k % 10 == 0) WriteTarget(t);
    if (k % 20 == 0 && t >= 0.0) WritePrediction(t);
    if (k % 8 == 0 && t >= 0.0) WritePlan(t, k % 800 == 0);
    if (k % 200 == 0) WriteObstacles(t);
  }

  void WriteTruth(double t) {
    truth_t m{};
    m.mission_time = t;
    const V p = Chaser(t), q = Target(t), to = q - p;
    const double h = 0.01, yaw = std::atan2(to.y(), to.x());
    bus::Set(m.pos, p);
    bus::Set(m.accel, V((Chaser(t + h) - 2.0 * p + Chaser(t - h)) / (h * h)));
    bus::Set(m.orientation, Eigen::Quaterniond(Eigen::AngleAxisd(yaw, V::UnitZ())));
    bus::Set(m.target_pos, q);
    m.target_px[0] = 187.5 + 60.0 * std::sin(0.7 * t) + 8.0 * std::sin(9.0 * t);
    m.target_px[1] = 119.5 + 25.0 * std::cos(0.9 * t);
    m.target_in_image = 1;
    m.visible_share = std::min(1.0, 0.95 + 0.1 * std::sin(t));
    Put("TRUTH", m, t);
  }

  void WritePose(double t) {
    pose_t m{};
    bus::Set(m.pos, V(Chaser(t) + flight_.odometry_error * V::UnitX()));
    m.orientation[0] = 1.0;
    Put("POSE", m, t);
  }

  void WriteTarget(double t) {
    target_t m{};
    m.state = t < -2.0 ? target_t::SEARCHING : target_t::TRACKING;
    bus::Set(m.mean, V(Target(t) + flight_.target_error * V::UnitY()));
    bus::Set(m.covariance, Eigen::Matrix3d(1e-3 * Eigen::Matrix3d::Identity()));
    Put("TARGET", m, t);
  }

  static polynomial_t Line(int64_t utime, const V& from, const V& to, double duration) {
    polynomial_t m{};
    m.utime = utime;
    m.duration = duration;
    m.n_coefficients = 6;
    m.coefficients = {from.x(),          from.y(),          from.z(),
                      to.x() - from.x(), to.y() - from.y(), to.z() - from.z()};
    return m;
  }

  void WritePrediction(double t) {
    prediction_t m{};
    const int64_t utime = Utime(t);
    const V v = (Target(t) - Target(t - 0.1)) / 0.1;
    m.target = Line(utime, Target(t), Target(t) + 2.5 * v, 2.5);
    m.radius = 0.15;
    m.height = 0.5;
    Put("PREDICTION", m, t);
  }

  void WritePlan(double t, bool fallback) {
    plan_t m{};
    const int64_t utime = Utime(t);
    m.verdict = fallback ? plan_t::KEPT : plan_t::CHASE;
    m.position = Line(utime, Chaser(t), Chaser(t + 2.5), 2.5);
    m.target = Line(utime, Target(t), Target(t + 2.5), 2.5);
    m.n_yaw = 1;
    m.yaw = {0.0};
    Put("PLAN", m, t);
  }

  void WriteObstacles(double t) {
    obstacles_t m{};
    for (const auto& c : scenario_.world.cylinders) {
      obstacle_t o{};
      o.id = m.n_obstacles++;
      const V p(c.center.x(), c.center.y(), 1.5);
      o.center = Line(Utime(t), p, p, 1.0);
      const double r = 1.0 / (1.3 * c.radius * 1.3 * c.radius);
      const double shape[6] = {r, 0, 0, r, 0, 0.3};
      std::copy(shape, shape + 6, o.shape);
      m.obstacles.push_back(o);
    }
    Put("OBSTACLES", m, t);
  }

  void WriteStatus(const std::string& name, const std::string& stage, double mean, double cpu) {
    status_t m{};
    m.name = name;
    m.state = status_t::OK;
    m.cpu = cpu;
    m.n_stages = 1;
    m.stages = {{stage, 100, mean, 0.9 * mean, 2.0 * mean, 3.0 * mean}};
    Put(name + "_STATUS", m, scenario_.duration_s);
  }

  SyntheticFlight flight_;
  world::Scenario scenario_;
  world::PathMotion motion_;
  OutputLog out_;
  int64_t origin_ = 0;
  std::map<std::string, int32_t> seqs_;  // the next of each channel
};

inline void WriteSyntheticLog(const std::string& file, const std::string& yaml,
                              const SyntheticFlight& flight = {}) {
  SyntheticLog(file, yaml, flight);
}

}  // namespace chase::logs::testing
