#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/world/scenario.h"
#include "common/world/trajectory.h"
#include "logs/src/info.h"

/// A flight as metrics need it: plain structs, frame W, m and s; `t` is mission time, negative
/// before the target starts to move.
namespace chase::logs {

struct TruthSample {
  double t = 0.0;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();       ///< p_WB
  Eigen::Vector3d a = Eigen::Vector3d::Zero();       ///< a_WB, m/s^2
  double speed = 0.0;                                ///< |v_WB|, m/s
  double yaw = 0.0;                                  ///< of the body, rad
  Eigen::Vector3d target = Eigen::Vector3d::Zero();  ///< p_WT
  double target_yaw = 0.0;                           ///< of its carrier, rad
  Eigen::Vector2d target_px = Eigen::Vector2d::Zero();
  bool target_in_image = false;
  double visible_share = 0.0;  ///< of the target's pixels in the last image
  /// It has not been up yet, or the flight's state has it on the ground, or on the way from or to
  /// it, or control comes down by itself and slowly: touching that is no harm.
  bool may_stand = false;
  bool done = false;  ///< it lies on the ground in DONE
};

/// The flight's state from then on.
struct StateSample {
  double t = 0.0;
  int state = 0;         ///< flight_state_t's constants
  std::string reason{};  ///< what led to it
};

/// A message of an input that may get too old.
struct HeardSample {
  double t = 0.0;      ///< when it was heard
  double stamp = 0.0;  ///< its own time
};

/// What control follows from then on.
struct TrackingSample {
  double t = 0.0;
  int following = 0;      ///< tracking_t's constants
  int32_t plan_seq = -1;  ///< of the plan that is followed
};

/// Does the autopilot come down by itself from then on, as FCU_STATUS says?
struct AutopilotSample {
  double t = 0.0;
  bool lands = false;
};

struct PoseSample {
  double t = 0.0;
  Eigen::Vector3d p = Eigen::Vector3d::Zero();  ///< p_WB as estimated
  double yaw = 0.0;                             ///< of the body, rad
  int32_t epoch = 0;                            ///< of the frame W that it is in
};

struct TargetSample {
  double t = 0.0;
  bool tracking = false;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();      ///< p_WT as perceived
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();  ///< v_WT as perceived, m/s
  bool known = false;                                  ///< tracked or occluded
  int32_t epoch = 0;                                   ///< of the frame W that it is in
};

struct PredictionSample {
  double t = 0.0;
  bool usable = false;       ///< false: there was nothing to predict
  world::Trajectory target;  ///< p_WT(t), in mission time
  int32_t epoch = 0;         ///< of the frame W that it is in
};

struct PlanSample {
  double t = 0.0;
  int verdict = 0;                        ///< plan_t's constants
  world::Trajectory position;             ///< p_WB(t), in mission time
  std::optional<world::Trajectory> stop;  ///< its way to rest, in mission time
  double certified_clearance = -1.0;      ///< m; negative: not certified
  double hard_radius = 0.0;               ///< m
  double heard = 0.0;                     ///< before t, which is when it takes over
  int32_t seq = -1;
};

/// A fault that struck.
struct FaultSample {
  double t = 0.0;
  std::string name;
  std::optional<double> end{};  ///< none: it lasted as long as the log
};

/// Figures of one stage of one process, ms.
struct StageFigures {
  std::string process, stage;
  long count = 0;
  double mean_ms = 0.0, p50_ms = 0.0, p99_ms = 0.0, max_ms = 0.0;
};

/// What a process occupies.
struct MemorySample {
  double uptime = 0.0;  ///< s; less than before: another process of that name
  double resident_mb = 0.0;
};

/// An obstacle as the chaser believed it to be at the end of the flight, for pictures.
struct PerceivedObstacle {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Matrix3d shape = Eigen::Matrix3d::Identity();  ///< R, 1/m^2
  bool moving = false;
};

struct FlightRecord {
  world::Scenario scenario;
  int64_t seed = 0;
  int64_t origin_utime = 0;        ///< of mission time zero, microseconds
  std::vector<TruthSample> truth;  ///< 100 Hz, in time order
  std::vector<PoseSample> poses;
  std::vector<TargetSample> targets;
  std::vector<PredictionSample> predictions;
  std::vector<PlanSample> plans;
  std::vector<FaultSample> faults;
  std::map<std::string, std::vector<HeardSample>>
      heard;  ///< by channel, of those with an age limit
  std::vector<TrackingSample> tracking;
  std::vector<AutopilotSample> autopilot;
  long nonfinite_setpoints = 0;     ///< ATTITUDE_SETPOINTs that hold a number which is none
  std::vector<StateSample> states;  ///< one for every change; none: no mission process was there
  std::vector<StageFigures> stages;
  std::vector<PerceivedObstacle> obstacles;
  LogInfo log;                          ///< what it was read from, and what is missing there
  std::map<std::string, double> cpu_s;  ///< by process
  std::map<std::string, std::vector<MemorySample>> memory;      ///< by process
  std::vector<std::pair<double, double>> sweep_to_setpoint_ms;  ///< of a sweep at t
  std::optional<double> real_time_factor;                       ///< logical over wall time

  /// True while the mission lasts: 0 <= t <= duration_s, give or take a microsecond.
  bool InMission(double t) const { return t >= -1e-6 && t <= scenario.duration_s + 1e-6; }
};

}  // namespace chase::logs
