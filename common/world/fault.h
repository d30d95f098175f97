#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <vector>

namespace chase::world {

/// A failure during a flight: an entry of a scenario's `faults`.
struct FaultSpec {
  static constexpr double kDrawn =
      -std::numeric_limits<double>::infinity();  ///< of `at`: drawn from the flight's seed
  std::string name;
  double at = kDrawn;
  double duration = -1.0;
  template <class V>
  void Visit(V& v) {
    v("name", name, "one of FaultKinds()");
    v("at", at,
      "mission time, s; negative: before the target moves; -.inf: drawn from the flight's seed");
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
    kBlackout,      ///< of the simulator: black frames
    kBlur,        ///< of the simulator: `amount` is the blur's length, shares of the image's width
    kExposure,    ///< of the simulator: `amount` times the light, cut at white
    kImuSpikes,   ///< of the simulator: `amount` is the share of samples
    kImuBias,     ///< of the simulator: `amount` standard deviations of the bias at power-on
    kLidarClock,  ///< of the simulator: `amount` is the step of the sweeps' stamps, s
    kGust,        ///< of the simulator: `amount` is added to the wind, m/s
    kMotor,       ///< of the simulator: `amount` is the share of thrust that one motor gives
    kHide,        ///< of the simulator: the target and its carrier are not there
    kDecoy,       ///< of the simulator: a second target, `amount` seconds ahead on its path
    kDelay,       ///< of a channel: `amount` is what its messages are late, s
    kLoss,        ///< of the bus: `amount` is the share of messages lost, at each receiver
    kFlood,       ///< of the bus: `amount` malformed messages a second on every channel
    kLoad,        ///< of all processes: each takes `amount` times as long
    kDiskFull,    ///< of the recorder: its files grow no more
  };
  /// What a flight must have for the fault to strike anything.
  enum class Needs { kNothing, kSensors, kRecorder };
  std::string name;
  Effect effect;
  std::string victim;  ///< the process or the channel that it strikes
  double duration;     ///< s; infinite: to the end of the flight, whatever the scenario says
  Needs needs;
  double amount = 0.0;  ///< as the effect says
};

/// Why the fault cannot strike a flight in lockstep, with the cure; empty: it can. `sensors`: the
/// simulator's are used, not the truth.
std::string Misfit(const FaultKind& kind, bool sensors);

/// Every fault. deploy/scenarios/README.md lists the names.
const std::vector<FaultKind>& FaultKinds();

/// The row of a name that Problem() accepts.
const FaultKind& KindOf(const FaultSpec& fault);

/// Puts figures for what is left open: its duration, and a time that is drawn from the flight's
/// seed, the fault's name and its `number` in the flight, uniform from 20 to 70 % of the mission
/// [s].
FaultSpec Settled(FaultSpec fault, double mission, int64_t seed, int number);

/// "kill-planning" or "kill-planning@12.5". Throws std::runtime_error, one line.
FaultSpec ParseFault(const std::string& text);

}  // namespace chase::world
