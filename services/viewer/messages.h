#pragma once

#include <map>
#include <string>
#include <vector>

#include "chase/flight_state_t.hpp"
#include "chase/geofence_t.hpp"
#include "chase/health_t.hpp"
#include "chase/obstacles_t.hpp"
#include "chase/plan_t.hpp"
#include "chase/pose_t.hpp"
#include "chase/prediction_t.hpp"
#include "chase/status_t.hpp"
#include "chase/target_t.hpp"
#include "chase/truth_t.hpp"
#include "services/viewer/page_text.h"
#include "services/viewer/scene.h"

/// Messages as the core wants them. `origin`: utime of the core's time zero.
namespace chase::viewer {

/// One of a message's constants; none of them is negative.
inline int Code(int8_t constant) { return static_cast<unsigned char>(constant); }

Drone FromMessage(const pose_t& m);
Target FromMessage(const target_t& m);
Plan FromMessage(const plan_t& m, int64_t origin);
Forecast FromMessage(const prediction_t& m, int64_t origin);
Flight FromMessage(const flight_state_t& m, int64_t origin);
Fence FromMessage(const geofence_t& m);
std::vector<world::Obstacle> FromMessage(const obstacles_t& m, int64_t origin);
/// Drone, target, movers.
std::vector<Body> FromMessage(const truth_t& m);

/// `before`: the process's last status, for its share of a core; nullptr: none.
ProcessHealth FromMessage(const status_t& m, const status_t* before);

/// A row for each process: what it says of itself, and what the mission process has heard of it at
/// `now` [us]; of one that only the latter has heard, that.
std::vector<ProcessHealth> Joined(const std::map<std::string, ProcessHealth>& heard,
                                  const health_t& mission, int64_t now);

/// The worst state, status_t's constants; who is silent counts as FAILED. -1: there is none.
int WorstState(const std::vector<ProcessHealth>& processes);

/// Mean time [ms] of what a stage did between two statuses; negative: nothing, or not known.
double MeanStageMs(const status_t& m, const status_t& before, const std::string& stage);

}  // namespace chase::viewer
