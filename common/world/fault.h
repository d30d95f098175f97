#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace chase::world {

/// A failure during a flight: an entry of a scenario's `faults`.
struct FaultSpec {
  std::string name;
  double at = -1.0;
  double duration = -1.0;
  template <class V>
  void Visit(V& v) {
    v("name", name, "one of FaultKinds()");
    v("at", at, "mission time, s; negative: drawn from the flight's seed");
    v("for", duration, "s; negative: as long as that fault lasts by itself");
  }
  std::string Problem() const;
};

/// What a fault's name stands for.
struct FaultKind {
  enum class Effect {
    kKill,          ///< of a process: it dies at once and a new one comes up
    kFreeze,        ///< of a process: it neither handles nor sends anything
    kSilenceLidar,  ///< of the simulator: no sweeps
  };
  std::string name;
  Effect effect;
  std::string process;  ///< that it strikes
  double duration;      ///< s; infinite: to the end of the flight, whatever the scenario says
  bool raw_only;        ///< strikes what a flight on true sensors does not have
};

/// Every fault. deploy/scenarios/README.md lists the names.
const std::vector<FaultKind>& FaultKinds();

/// The row of a name that Problem() accepts.
const FaultKind& KindOf(const FaultSpec& fault);

/// Puts figures for what is left open: its duration, and a time that is drawn from the flight's
/// seed, uniform from 20 to 70 % of the mission [s]. `number` tells the flight's faults apart.
FaultSpec Settled(FaultSpec fault, double mission, int64_t seed, int number);

/// "kill-planning" or "kill-planning@12.5". Throws std::runtime_error, one line.
FaultSpec ParseFault(const std::string& text);

}  // namespace chase::world
