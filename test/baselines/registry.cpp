#include "test/baselines/registry.h"

#include <algorithm>
#include <charconv>
#include <stdexcept>

namespace chase::baselines {
namespace {

std::vector<Entry>& Entries() {
  static std::vector<Entry> entries;
  return entries;
}

struct Name {
  std::string planner, set;
};
Name Split(const std::string& name) {
  const size_t colon = name.find(':');
  if (colon == std::string::npos) return {name, ""};
  if (colon + 1 == name.size())
    throw std::invalid_argument("planner '" + name + "': after the colon goes a number or 'all'");
  return {name.substr(0, colon), name.substr(colon + 1)};
}

Entry Find(const std::string& name) {
  std::string known;
  for (const Entry& e : Planners()) {
    if (e.name == name) return e;
    known += (known.empty() ? "" : ", ") + e.name;
  }
  throw std::invalid_argument("planner '" + name + "' is not known; choose from " + known);
}

int SetNumber(const Entry& entry, const std::string& text) {
  int n = 0;
  const char* end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data(), end, n);
  if (error != std::errc() || rest != end || n < 1 || n > entry.n_sets)
    throw std::invalid_argument("planner " + entry.name + " has no parameter set '" + text +
                                "'; it has " + std::to_string(entry.n_sets));
  return n;
}

/// The paper taken literally: its sight condition, fixed skeletons, every candidate tested.
std::unique_ptr<planning::Planner> MakeReference(const Setup& setup) {
  planning::PlannerConfig config = setup.config;
  config.adaptive = config.refine = config.exact_visibility = false;
  return planning::MakePlanner("reference-double", config);
}

/// Ours on the candidates of the paper: 12 skeletons at each of 3 steps, 1,728 quintics.
std::unique_ptr<planning::Planner> MakeChasePaper(const Setup& setup) {
  planning::PlannerConfig config = setup.config;
  config.degree = 5;
  config.steps = 3;
  config.skeletons = 12;
  return planning::MakePlanner("chase", config);
}

const Registration kChase(
    "chase", [](const Setup& s) { return planning::MakePlanner("chase", s.config); }, true);
const Registration kChasePaper("chase_paper", MakeChasePaper);
const Registration kReference("reference", MakeReference, true);

}  // namespace

Registration::Registration(const std::string& name, Maker maker, bool by_default, int n_sets) {
  Entries().push_back({name, std::move(maker), by_default, n_sets});
}

std::vector<Entry> Planners() {
  std::vector<Entry> sorted = Entries();
  std::sort(sorted.begin(), sorted.end(), [](const Entry& a, const Entry& b) {
    const bool a_first = a.name == "chase", b_first = b.name == "chase";
    return a_first != b_first ? a_first : a.name < b.name;
  });
  return sorted;
}

std::unique_ptr<planning::Planner> MakePlanner(const std::string& name, const Setup& setup) {
  const Name parts = Split(name);
  const Entry entry = Find(parts.planner);
  Setup mine = setup;
  if (!parts.set.empty()) mine.parameter_set = SetNumber(entry, parts.set);
  return entry.make(mine);
}

std::vector<std::string> Expand(const std::string& name) {
  const Name parts = Split(name);
  const Entry entry = Find(parts.planner);
  if (parts.set.empty()) return {name};
  if (parts.set != "all") return SetNumber(entry, parts.set), std::vector<std::string>{name};
  std::vector<std::string> names;
  for (int n = 1; n <= entry.n_sets; ++n) names.push_back(entry.name + ":" + std::to_string(n));
  if (names.empty())
    throw std::invalid_argument("planner " + entry.name + " has no parameter sets");
  return names;
}

}  // namespace chase::baselines
