#include "logs/src/landing_figures.h"

#include <algorithm>

#include "chase/flight_state_t.hpp"

namespace chase::logs {

namespace {

constexpr double kLegs = 0.02;  // m
constexpr double kOver = 0.1;   // s that the speed before touchdown is taken over
constexpr const char* kNames[] = {"IDLE",   "READY",  "TAKEOFF", "CHASE", "HOLD",
                                  "SEARCH", "RETURN", "LAND",    "DONE",  "EMERGENCY"};

}  // namespace

std::string StateName(int state) { return kNames[state]; }

void AddLanding(const FlightRecord& record, Metrics* metrics) {
  for (const StateSample& s : record.states)
    metrics->flight_states.push_back({StateName(s.state), s.t, s.reason});
  const std::vector<TruthSample>& truth = record.truth;
  const bool done = !record.states.empty() && record.states.back().state == flight_state_t::DONE;
  if (!done || truth.empty()) return;
  const double stands = truth.back().p.z();
  const double off = record.states.back().t;
  const auto above = std::find_if(truth.rbegin(), truth.rend(), [&](const TruthSample& s) {
    return s.t < off && s.p.z() > stands + kLegs;
  });
  if (above == truth.rend()) return;
  const auto before = std::find_if(above, truth.rend(),
                                   [&](const TruthSample& s) { return s.t <= above->t - kOver; });
  if (before == truth.rend()) return;
  metrics->touchdown_speed_mps = (before->p.z() - above->p.z()) / (above->t - before->t);
  metrics->motors_off_s = off - above->t;
}

std::optional<int> StateAt(const FlightRecord& record, double t) {
  const auto next = std::upper_bound(record.states.begin(), record.states.end(), t,
                                     [](double at, const StateSample& s) { return at < s.t; });
  if (next == record.states.begin()) return std::nullopt;
  return std::prev(next)->state;
}

bool ComesDown(const FlightRecord& record, double t) {
  const auto state = StateAt(record, t);
  return state == flight_state_t::LAND || state == flight_state_t::DONE;
}

bool InOrder(const std::vector<std::string>& wanted, const std::vector<StateFigures>& states) {
  auto at = states.begin();
  for (const std::string& name : wanted) {
    at = std::find_if(at, states.end(), [&](const StateFigures& s) { return s.name == name; });
    if (at == states.end()) return false;
    ++at;
  }
  return true;
}

}  // namespace chase::logs
