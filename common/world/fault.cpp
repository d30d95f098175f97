#include "common/world/fault.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>
#include <utility>

#include "common/config/config.h"
#include "common/world/random.h"

namespace chase::world {
namespace {

using Effect = FaultKind::Effect;
using Needs = FaultKind::Needs;

// A restarted process is there again after its start-up; measured from 0.01 to 0.44 s.
constexpr double kRestart = 0.5;
constexpr double kFreeze = 2.0;
constexpr double kLidarGap = 1.0;
// An automatic exposure has settled after a second; two stops are the step from shade into the sun.
constexpr double kExposureTime = 1.0, kTwoStops = 4.0;
constexpr double kSensorTime = 2.0;  // of a sensor's error that passes, as long as a freeze
constexpr double kBusTime = 10.0;    // a hundred sweeps
constexpr double kDecoyTime = 10.0;  // long against the target's tracks, which live for seconds
constexpr double kForGood = std::numeric_limits<double>::infinity();
constexpr uint64_t kStream = 0xFA017;  // of the draws, apart from all noise

std::vector<FaultKind> MakeKinds() {
  std::vector<FaultKind> kinds;
  const std::pair<std::string, Needs> processes[] = {
      {"odometry", Needs::kSensors},   {"mapping", Needs::kSensors},
      {"perception", Needs::kSensors}, {"prediction", Needs::kNothing},
      {"planning", Needs::kNothing},   {"control", Needs::kNothing},
      {"mission", Needs::kNothing}};
  for (const auto& [process, needs] : processes) {
    kinds.push_back({"kill-" + process, Effect::kKill, process, kRestart, needs});
    kinds.push_back({"freeze-" + process, Effect::kFreeze, process, kFreeze, needs});
  }
  const std::pair<std::string, Needs> channels[] = {{"LIDAR_SCAN", Needs::kSensors},
                                                    {"CAMERA_IMAGE", Needs::kSensors},
                                                    {"IMU", Needs::kSensors},
                                                    {"POSE", Needs::kNothing},
                                                    {"SCAN_REGISTERED", Needs::kSensors},
                                                    {"OBSTACLES", Needs::kNothing},
                                                    {"UNSEEN", Needs::kSensors},
                                                    {"TARGET", Needs::kNothing},
                                                    {"PREDICTION", Needs::kNothing},
                                                    {"PLAN", Needs::kNothing},
                                                    {"ATTITUDE_SETPOINT", Needs::kNothing},
                                                    {"TRACKING", Needs::kNothing},
                                                    {"FLIGHT_STATE", Needs::kNothing}};
  for (const auto& [channel, needs] : channels)
    kinds.push_back({"delay-" + channel, Effect::kDelay, channel, kFreeze, needs, 0.3});
  const std::string s = "simulator";
  const FaultKind others[] = {
      {"lidar-gap", Effect::kSilenceLidar, s, kLidarGap, Needs::kSensors},
      {"lidar-dead", Effect::kSilenceLidar, s, kForGood, Needs::kSensors},
      {"camera-blackout", Effect::kBlackout, s, kSensorTime, Needs::kSensors},
      {"camera-blur", Effect::kBlur, s, kSensorTime, Needs::kSensors, 1.0 / 16.0},
      {"exposure-jump", Effect::kExposure, s, kExposureTime, Needs::kSensors, kTwoStops},
      {"imu-spikes", Effect::kImuSpikes, s, kSensorTime, Needs::kSensors, 0.02},
      {"imu-bias", Effect::kImuBias, s, kForGood, Needs::kSensors, 5.0},
      {"loss-5", Effect::kLoss, "", kBusTime, Needs::kNothing, 0.05},
      {"loss-20", Effect::kLoss, "", kBusTime, Needs::kNothing, 0.20},
      {"clock-forward", Effect::kLidarClock, s, kSensorTime, Needs::kSensors, 1.0},
      {"clock-back", Effect::kLidarClock, s, kSensorTime, Needs::kSensors, -1.0},
      {"gust", Effect::kGust, s, kSensorTime, Needs::kNothing, 8.0},
      {"motor-80", Effect::kMotor, s, kForGood, Needs::kNothing, 0.8},
      {"hidden-4s", Effect::kHide, s, 4.0, Needs::kSensors},
      {"hidden-for-good", Effect::kHide, s, kForGood, Needs::kSensors},
      {"decoy", Effect::kDecoy, s, kDecoyTime, Needs::kSensors, 2.0},
      {"flood", Effect::kFlood, "", kSensorTime, Needs::kNothing, 1000.0},
      {"cpu-load", Effect::kLoad, "", kBusTime, Needs::kNothing, 5.0},
      {"disk-full", Effect::kDiskFull, "recorder", kForGood, Needs::kRecorder}};
  kinds.insert(kinds.end(), std::begin(others), std::end(others));
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

std::string Misfit(const FaultKind& kind, bool sensors) {
  if (kind.needs == Needs::kSensors && !sensors)
    return "strikes nothing where sensors is truth; fly with --sensors raw";
  if (kind.needs == Needs::kRecorder)
    return "strikes chase-recorder, which a flight in lockstep does not have; fly live, by "
           "deploy/fly";
  return "";
}

const FaultKind& KindOf(const FaultSpec& fault) {
  const FaultKind* kind = Find(fault.name);
  if (kind == nullptr) throw std::runtime_error(fault.Problem());
  return *kind;
}

std::string FaultSpec::Problem() const {
  const FaultKind* kind = Find(name);
  if (kind == nullptr) return "name is '" + name + "'; it must be one of " + KnownNames();
  if (!std::isfinite(at) && at != kDrawn)
    return "at is " + config::detail::FormatNumber(at) +
           "; it must be a mission time in s, or left out to be drawn from the seed";
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
  if (fault.at == FaultSpec::kDrawn) {
    uint64_t stream = kStream + static_cast<uint64_t>(number);
    for (const char letter : fault.name) stream = 31 * stream + static_cast<unsigned char>(letter);
    Random random(static_cast<uint64_t>(seed), stream);
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
    if (used == 0 || used != number.size() || !std::isfinite(fault.at))
      throw std::runtime_error("'" + number +
                               "' is no mission time in s; give NAME@SECONDS, or NAME alone for " +
                               "a time drawn from the seed");
  }
  const std::string problem = fault.Problem();
  if (!problem.empty()) throw std::runtime_error(problem);
  return fault;
}

}  // namespace chase::world
