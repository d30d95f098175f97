#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "common/world/sweep_run.h"
#include "services/mission/mission_config.h"

namespace chase::mission {

/// What odometry says. Frame W.
struct PoseReport {
  double t = 0.0;                                                            ///< s
  Eigen::Vector3d p = Eigen::Vector3d::Zero(), v = Eigen::Vector3d::Zero();  ///< m, m/s
  int32_t epoch = 0;                                                         ///< of the frame W
  bool usable = false;                                                       ///< to fly by
  bool healthy = false;                                                      ///< to take off by
  std::string reason;  ///< why it is not healthy
};

/// What a process says of itself.
struct ProcessReport {
  double t = 0.0;    ///< s
  int8_t state = 0;  ///< one of status_t's constants
  bool failed = false;
  int64_t start = 0;  ///< when it started; another number is another process
  int64_t first = 0;  ///< the start of the one that was heard first
  int restarts = 0;
};

/// The newest of everything that the flight depends on. Times in seconds of one clock.
struct Inputs {
  std::optional<PoseReport> pose;
  std::optional<double> obstacles;  ///< when they were valid, s
  world::SweepRun sweeps;           ///< in a row, listed while odometry was OK
  std::optional<double> target;
  std::optional<double> prediction;  ///< of the newest forecast, s
  bool target_tracked = false;
  double plan_heard = -1e9;                            ///< s
  std::string plan_reason;                             ///< of the newest plan
  Eigen::Vector3d plan_end = Eigen::Vector3d::Zero();  ///< where the newest plan ends, frame W
  bool flying = false, landing = false;                ///< as control says
  bool motors_off = false;                             ///< control has stopped them
  /// Places on the newest plan up to its stop and on to rest: where it flies if nothing more comes.
  std::vector<Eigen::Vector3d> way;  ///< frame W
  bool blocked = false;              ///< something reaches into the climb's column
  std::string autopilot;             ///< what fcu says of it: state and reason
  bool handed_over = false;          ///< and that is why the flight is not ours any more
  bool on_ground = false;            ///< the autopilot says that it stands there
  bool armed = false;                ///< the autopilot says that it is, whoever flies it
  std::optional<double> disarmed;    ///< when it said last that it stands there disarmed, s
  std::optional<double> battery;     ///< share of its charge; nothing: nobody has said
  double battery_heard = -1e9;       ///< when, s
  std::map<std::string, ProcessReport> processes;  ///< by name

  void Heard(const std::string& process, ProcessReport report);
};

/// What stands against taking off at time `t` [s], a phrase each; empty: nothing.
std::vector<std::string> Missing(const MissionConfig& config, const Inputs& inputs, double t);

/// Why planning has no forecast of the target at time `t` [s]; empty: it has. Where none has been
/// heard yet, as after a start in flight, it is what prediction says of itself.
std::string ForecastProblem(const Inputs& inputs, double t);

/// Is the target tracked and its motion forecast, by news that are fresh?
bool SeesTarget(const Inputs& inputs, double t);

}  // namespace chase::mission
