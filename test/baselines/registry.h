#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "services/planning/planner.h"

namespace chase::baselines {

/// What a planner of the comparison is made from.
struct Setup {
  planning::PlannerConfig config;  ///< the scenario's: distance, sizes and limits are for everybody
  std::string scenario;            ///< its name, such as S7
  int parameter_set = 0;           ///< 1..20 where a planner has tuned sets; 0: its choice
};
using Maker = std::function<std::unique_ptr<planning::Planner>(const Setup&)>;

/// Puts a planner into the comparison: one object of static storage in the planner's own file.
struct Registration {
  Registration(const std::string& name, Maker maker, bool by_default = false, int n_sets = 0);
};

struct Entry {
  std::string name;
  Maker make;
  bool by_default = false;  ///< flies when no planners are named
  int n_sets = 0;           ///< parameter sets that `name:all` stands for
};
/// All planners, "chase" first, then by name.
std::vector<Entry> Planners();

/// `name`, or `name:N` for its parameter set N. Throws std::invalid_argument with one line that
/// lists the known planners.
std::unique_ptr<planning::Planner> MakePlanner(const std::string& name, const Setup& setup);

/// `name` itself, or every parameter set of `name:all`. Throws as MakePlanner does.
std::vector<std::string> Expand(const std::string& name);

}  // namespace chase::baselines
