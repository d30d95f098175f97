#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "logs/src/flight_record.h"
#include "logs/src/score.h"

namespace chase::logs {

struct TimeFigures {
  double mean = 0.0, p50 = 0.0, p99 = 0.0, max = 0.0;  ///< ms
};

/// A state that the flight was in.
struct StateFigures {
  std::string name;   ///< of flight_state_t's constant
  double at_s = 0.0;  ///< mission time of its beginning
  std::string reason;
};

/// How the flight took a fault.
struct FaultFigures {
  std::string name;
  double at_s = 0.0;                 ///< mission time
  std::optional<double> end_s;       ///< mission time; none: it did not end
  std::string input;                 ///< that was reacted to, or not, for the longest; empty: none
  std::optional<double> reaction_s;  ///< from that input's age limit; none: none was reached
  std::optional<double> recovery_s;  ///< from its end; none: no end, or not recovered
};

/// Figures of a flight; empty where the log holds nothing to compute them from. Definitions: see
/// logs/README.md.
struct Metrics {
  using Figure = std::optional<double>;

  Figure safe_ratio, min_clearance_m, visible_ratio, in_image_ratio;
  Figure distance_ratio, distance_error, travel_ratio;
  Figure acceleration_cost, jerk_cost, yaw_rate_rms;
  std::optional<TimeFigures> plan_ms, predict_ms, sweep_to_setpoint_ms;
  long replans = 0, fallbacks = 0;
  Figure odometry_ate_m, odometry_ate_aligned_m, target_rmse_m, prediction_error_m;
  std::map<double, double> prediction_error_by_horizon_m;                    ///< horizon in s
  std::map<double, double> prediction_error_constant_velocity_by_horizon_m;  ///< the same
  Figure certified_clearance_m, certificate_kept_ratio, tube_exceeded_ratio, tracking_error_p99_m;
  std::map<int, double> verdict_s;              ///< time under each of plan_t's verdicts
  std::map<std::string, double> cpu_s;          ///< by process
  std::map<std::string, double> memory_growth;  ///< by process that ran longer than a minute
  std::map<std::string, int> restarts;          ///< by process that was started anew
  Figure real_time_factor;
  std::string fault;                 ///< names of those that struck, joined by +
  double fault_time_s = -1.0;        ///< mission time of the first; -1: none
  std::vector<FaultFigures> faults;  ///< in the order of their beginnings
  Figure reaction_s;  ///< the longest of the faults'; none: no input reached its limit
  Figure recovery_s;  ///< the same; none also where one was not recovered from
  long nonfinite_setpoints = 0;
  double begins_s = 0.0, flown_s = 0.0;          ///< mission times of the first and last sample
  double collision_s = -1.0;                     ///< mission time of the first contact; -1: none
  std::string collided_with;                     ///< as Scorer::Nearest() names it; empty: nothing
  double struck_after_done_s = -1.0;             ///< first sample after DONE that touches; -1: none
  std::map<std::string, int64_t> lost_messages;  ///< by channel, by `seq`
  std::map<std::string, double> longest_gap_s;   ///< by channel, without an event
  std::map<std::string, double> gap_begins_s;    ///< that one's, after the log's first event
  std::map<std::string, TextByProcess> software;  ///< versions, hosts, configurations
  std::vector<std::string> losses;                ///< a line for each, for people
  bool log_whole = true;                          ///< neither cut off nor damaged
  std::vector<StateFigures> flight_states;  ///< in their order; none without a mission process
  Figure touchdown_speed_mps;               ///< of the landing that ended the flight
  Figure motors_off_s;                      ///< after touchdown
  /// Plans while the flight is up, of those BRAKE without a certificate or MITIGATE, and BRAKE that
  /// speeds up.
  long plans_in_air = 0, uncertified_brakes = 0, accelerating_brakes = 0;
  std::map<std::string, bool> criteria;

  bool HoldsBeginning() const;  ///< of the mission
  bool Passed() const;
};

/// Scores of every truth sample with 0 <= t <= duration_s.
std::vector<SampleScore> Score(const FlightRecord& record);

Metrics Compute(const FlightRecord& record);
Metrics Compute(const FlightRecord& record, const std::vector<SampleScore>& scores);

/// The keys of metrics.json; what could not be computed is null.
std::string MetricsJson(const FlightRecord& record, const Metrics& metrics);
/// Throws std::runtime_error with one line when the file cannot be written.
void WriteMetricsJson(const std::string& file, const FlightRecord& record, const Metrics& metrics);

}  // namespace chase::logs
