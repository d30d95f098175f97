#include "services/mission/inputs.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <utility>

#include "common/world/ages.h"

namespace chase::mission {

namespace {

std::string Age(double age) {
  char text[32];
  std::snprintf(text, sizeof text, " is %.1f s old", age);
  return text;
}

std::string Percent(double share) {
  char text[32];
  std::snprintf(text, sizeof text, "%.0f %%", 100.0 * share);
  return text;
}

/// Why an input of that time is not there; empty: it is.
std::string Absence(const std::string& name, const std::optional<double>& heard, double most,
                    double t) {
  if (!heard) return name + " is not heard";
  return t - *heard > most ? name + Age(t - *heard) : "";
}

/// It flies without them, and its own end is not its own to tell.
bool LooksOn(const std::string& name) {
  return name == "mission" || name == "viewer" || name == "link";
}

/// In the air the charge that was heard last counts: whoever told it may have died.
std::string BatteryProblem(const MissionConfig& config, const Inputs& inputs, double t) {
  if (!inputs.battery || t - inputs.battery_heard > world::kMostAge.status)
    return "the battery's charge is not known: FCU_STATUS does not tell it";
  return *inputs.battery <= config.battery_low ? "the battery is low: " + Percent(*inputs.battery)
                                               : "";
}

/// The climb ends below climb_height; control flies no plan that leads out.
std::string CeilingProblem(const MissionConfig& config) {
  if (!config.geofence.Exists() || config.geofence.ceiling >= config.climb_height) return "";
  return fmt::format(
      "the geofence's ceiling of {} m is below climb_height, {} m: raise geofence: ceiling, or "
      "lower climb_height and with it planning's takeoff_height",
      config.geofence.ceiling, config.climb_height);
}

std::string ProcessProblem(const std::string& name, const Inputs& inputs, double t) {
  const auto found = inputs.processes.find(name);
  const bool heard = found != inputs.processes.end();
  const std::optional<double> when = heard ? std::optional(found->second.t) : std::nullopt;
  std::string problem = Absence(name, when, world::kMostAge.status, t);
  if (problem.empty() && found->second.failed) problem = name + " has failed";
  return problem;
}

}  // namespace

void Inputs::Heard(const std::string& process, ProcessReport report) {
  report.first = report.start;
  const auto [at, fresh] = processes.emplace(process, report);
  if (fresh) return;
  report.first = at->second.first;
  report.restarts = at->second.restarts + (at->second.start != report.start ? 1 : 0);
  at->second = report;
}

std::vector<std::string> Missing(const MissionConfig& config, const Inputs& inputs, double t) {
  std::vector<std::string> missing;
  const auto note = [&missing](std::string what) {
    if (!what.empty()) missing.push_back(std::move(what));
  };
  const std::optional<PoseReport>& pose = inputs.pose;
  const std::optional<double> pose_time = pose ? std::optional(pose->t) : std::nullopt;
  note(Absence("POSE", pose_time, world::kMostAge.pose, t));
  if (pose && !pose->healthy)
    note("odometry is not healthy" + (pose->reason.empty() ? "" : ": " + pose->reason));
  note(Absence("OBSTACLES", inputs.obstacles, world::kMostAge.obstacles, t));
  if (!inputs.sweeps.IsEnough())
    note(fmt::format("{} of {} good sweeps in a row", inputs.sweeps.count(),
                     world::SweepRun::kEnough));
  note(Absence("TARGET", inputs.target, world::kMostAge.target, t));
  if (inputs.blocked) note("the way up is not free: something is above the take-off place");
  note(CeilingProblem(config));
  if (config.battery_low > 0.0) note(BatteryProblem(config, inputs, t));
  for (const std::string& name : config.needs) note(ProcessProblem(name, inputs, t));
  for (const auto& [name, report] : inputs.processes)
    if (std::find(config.needs.begin(), config.needs.end(), name) == config.needs.end() &&
        !LooksOn(name))
      note(ProcessProblem(name, inputs, t));
  return missing;
}

std::string ForecastProblem(const Inputs& inputs, double t) {
  return inputs.prediction ? Absence("PREDICTION", inputs.prediction, world::kMostAge.prediction, t)
                           : ProcessProblem("prediction", inputs, t);
}

bool SeesTarget(const Inputs& inputs, double t) {
  return inputs.target && inputs.target_tracked && t - *inputs.target <= world::kMostAge.target &&
         ForecastProblem(inputs, t).empty();
}

}  // namespace chase::mission
