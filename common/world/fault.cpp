#include "common/world/fault.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "common/config/config.h"
#include "common/world/random.h"

namespace chase::world {
namespace {

using Effect = FaultKind::Effect;

// A restarted process is there again after its start-up; measured from 0.01 to 0.44 s.
constexpr double kRestart = 0.5;
constexpr double kFreeze = 2.0;
constexpr double kLidarGap = 1.0;
constexpr double kForGood = std::numeric_limits<double>::infinity();
constexpr uint64_t kStream = 0xFA017;  // of the draws, apart from all noise

std::vector<FaultKind> MakeKinds() {
  std::vector<FaultKind> kinds;
  for (const char* process :
       {"odometry", "mapping", "perception", "prediction", "planning", "control"}) {
    const std::string name = process;
    const bool raw_only = name == "odometry" || name == "mapping" || name == "perception";
    kinds.push_back({"kill-" + name, Effect::kKill, name, kRestart, raw_only});
    kinds.push_back({"freeze-" + name, Effect::kFreeze, name, kFreeze, raw_only});
  }
  kinds.push_back({"lidar-gap", Effect::kSilenceLidar, "simulator", kLidarGap, true});
  kinds.push_back({"lidar-dead", Effect::kSilenceLidar, "simulator", kForGood, true});
  return kinds;
}

const FaultKind* Find(const std::string& name) {
  for (const FaultKind& kind : FaultKinds())
    if (kind.name == name) return &kind;
  return nullptr;
}

std::string KnownNames() {
  std::string all;
  for (const FaultKind& kind : FaultKinds()) all += (all.empty() ? "" : ", ") + kind.name;
  return all;
}

}  // namespace

const std::vector<FaultKind>& FaultKinds() {
  static const std::vector<FaultKind> kinds = MakeKinds();
  return kinds;
}

const FaultKind& KindOf(const FaultSpec& fault) {
  const FaultKind* kind = Find(fault.name);
  if (kind == nullptr) throw std::runtime_error(fault.Problem());
  return *kind;
}

std::string FaultSpec::Problem() const {
  const FaultKind* kind = Find(name);
  if (kind == nullptr) return "name is '" + name + "'; it must be one of " + KnownNames();
  if (!std::isfinite(at))
    return "at is " + config::detail::FormatNumber(at) +
           "; it must be a mission time in s, or negative to be drawn from the seed";
  const bool endless = std::isinf(kind->duration);
  if (endless && !(duration < 0.0) && duration != kind->duration)
    return "for is " + config::detail::FormatNumber(duration) + "; " + name +
           " lasts to the end of the flight: leave the key out";
  if (!endless && (duration == 0.0 || !std::isfinite(duration)))
    return "for is " + config::detail::FormatNumber(duration) +
           "; it must be above 0 s, or left out for the fault's own length";
  return "";
}

FaultSpec Settled(FaultSpec fault, double mission, int64_t seed, int number) {
  if (fault.at < 0.0) {
    Random random(static_cast<uint64_t>(seed), kStream + static_cast<uint64_t>(number));
    const double drawn = random.Uniform(0.2 * mission, 0.7 * mission);
    fault.at = std::round(100.0 * drawn) / 100.0;  // so that NAME@SECONDS repeats it
  }
  if (fault.duration < 0.0) fault.duration = KindOf(fault).duration;
  return fault;
}

FaultSpec ParseFault(const std::string& text) {
  const std::size_t sign = text.find('@');
  FaultSpec fault;
  fault.name = text.substr(0, sign);
  if (sign != std::string::npos) {
    const std::string number = text.substr(sign + 1);
    std::size_t used = 0;
    try {
      fault.at = std::stod(number, &used);
    } catch (const std::exception&) {
    }
    if (used == 0 || used != number.size() || !(fault.at >= 0.0))
      throw std::runtime_error("'" + number +
                               "' is no mission time; give NAME@SECONDS with 0 s or " +
                               "more, or NAME alone for a time drawn from the seed");
  }
  const std::string problem = fault.Problem();
  if (!problem.empty()) throw std::runtime_error(problem);
  return fault;
}

}  // namespace chase::world
