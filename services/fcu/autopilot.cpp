#include "services/fcu/autopilot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace chase::fcu {
namespace {

constexpr uint8_t kComponent = 1;  // MAV_COMP_ID_AUTOPILOT1
// That are remembered: checks that fail, and what was said together.
constexpr std::size_t kMostChecks = 4, kMostWarnings = 3;
constexpr int64_t kTogether = 1'000'000;  // us after the first of them
// s: of what comes once a second where it has not been asked for.
constexpr double kStateAge = 2.5;

template <class E>
bool Has(uint8_t bits, E flag) {
  return (bits & static_cast<uint32_t>(flag)) != 0;
}

bool IsOld(int64_t heard, int64_t utime) {
  return 1e-6 * static_cast<double>(utime - heard) > kStateAge;
}

/// Of mV; 0: not known.
double Volts(uint16_t millivolts) { return millivolts == UINT16_MAX ? 0.0 : 1e-3 * millivolts; }

void AddLast(const std::string& text, std::size_t most, std::deque<std::string>* texts) {
  texts->erase(std::remove(texts->begin(), texts->end(), text), texts->end());
  texts->push_back(text);
  if (texts->size() > most) texts->pop_front();
}

}  // namespace

bool Autopilot::Take(const Frame& frame, int64_t utime) {
  if (frame.component != kComponent) return false;
  if (frame.id == mav::Heartbeat::kId && !TakeHeartbeat(frame, utime)) return false;
  if (!known() || frame.system != system_) return false;
  frame_utime_ = std::max(frame_utime_, utime);
  TakeState(frame, utime);
  return true;
}

bool Autopilot::MayBe(const Frame& frame) const {
  return frame.component == kComponent && stranger_.empty() &&
         (system_ == 0 || frame.system == system_);
}

bool Autopilot::TakeHeartbeat(const Frame& frame, int64_t utime) {
  const auto m = *As<mav::Heartbeat>(frame);
  if (system_ != 0 && frame.system != system_) return false;
  if (m.autopilot != static_cast<uint8_t>(mav::MavAutopilot::PX4)) {
    stranger_ = fmt::format("system {} is no PX4 (MAV_AUTOPILOT {})", frame.system, m.autopilot);
    return false;
  }
  stranger_.clear();
  system_ = frame.system;
  heartbeat_ = m;
  if (armed()) failed_checks_.clear();
  heartbeat_utime_ = utime;
  return true;
}

void Autopilot::TakeState(const Frame& frame, int64_t utime) {
  if (const auto m = As<mav::AttitudeQuaternion>(frame)) {
    const Eigen::Quaterniond q(m->q1, m->q2, m->q3, m->q4);
    if (std::abs(q.norm() - 1.0) < 0.01) attitude_ = Attitude{utime, SwapFrames(q)};
  } else if (const auto p = As<mav::LocalPositionNed>(frame)) {
    const Eigen::Vector3d position(p->x, p->y, p->z);
    if (position.allFinite()) position_ = SwapWorld(position);
  } else if (const auto e = As<mav::ExtendedSysState>(frame)) {
    landed_ = e->landed_state;
    landed_utime_ = utime;
  } else if (const auto s = As<mav::SysStatus>(frame)) {
    battery_ = {s->battery_remaining, Volts(s->voltage_battery), utime};
  } else if (const auto b = As<mav::BatteryStatus>(frame)) {
    double volts = 0.0;
    for (const uint16_t cell : b->voltages) volts += Volts(cell);
    for (const uint16_t cell : b->voltages_ext) volts += Volts(cell);
    batteries_[b->id] = {b->battery_remaining, volts, utime};
  } else if (const auto r = As<mav::RcChannels>(frame)) {
    channels_ = r->chancount;
    channels_utime_ = utime;
  } else if (const auto t = As<mav::Statustext>(frame)) {
    const auto whole = texts_.Add(utime, *t);
    if (whole && whole->severity <= static_cast<uint8_t>(mav::MavSeverity::WARNING))
      TakeText(*whole, utime);
  }
}

/// PX4 says once which check fails, when it does; a refusal much later is "resolve system health
/// failures first". In flight it says the cause first, then "Failsafe activated".
void Autopilot::TakeText(const StatusText& text, int64_t utime) {
  if (!armed() && text.text.rfind("Preflight Fail", 0) == 0)
    return AddLast(text.text, kMostChecks, &failed_checks_);
  if (warnings_.empty() || utime - warned_utime_ > kTogether) {
    warnings_.clear();
    warned_utime_ = utime;
  }
  const bool said = std::find(warnings_.begin(), warnings_.end(), text.text) != warnings_.end();
  if (!said && warnings_.size() < kMostWarnings) warnings_.push_back(text.text);
}

double Autopilot::silence(int64_t utime) const {
  return 1e-6 * static_cast<double>(utime - heartbeat_utime_);
}

bool Autopilot::armed() const { return Has(heartbeat_.base_mode, mav::MavModeFlag::SAFETY_ARMED); }

bool Autopilot::terminated() const {
  return heartbeat_.system_status == static_cast<uint8_t>(mav::MavState::FLIGHT_TERMINATION);
}

bool Autopilot::failsafe() const {
  switch (static_cast<mav::MavState>(heartbeat_.system_status)) {
    case mav::MavState::CRITICAL:
    case mav::MavState::EMERGENCY:
    case mav::MavState::FLIGHT_TERMINATION:
      return true;
    default:
      return false;
  }
}

mav::MavLandedState Autopilot::Landed(int64_t utime) const {
  return IsOld(landed_utime_, utime) ? mav::MavLandedState::UNDEFINED
                                     : static_cast<mav::MavLandedState>(landed_);
}

bool Autopilot::on_ground(int64_t utime) const {
  return Landed(utime) == mav::MavLandedState::ON_GROUND;
}

/// Of those whose charge has been told of late; null: none.
const Autopilot::Battery* Autopilot::Emptiest(int64_t utime) const {
  const Battery* emptiest = nullptr;
  const auto see = [&](const Battery& b) {
    if (b.percent < 0 || IsOld(b.utime, utime)) return;
    if (emptiest == nullptr || b.percent < emptiest->percent) emptiest = &b;
  };
  see(battery_);
  for (const auto& [id, battery] : batteries_) see(battery);
  return emptiest;
}

std::string Autopilot::Unfit() const {
  switch (static_cast<mav::MavState>(heartbeat_.system_status)) {
    case mav::MavState::CALIBRATING:
      return "the autopilot calibrates";
    case mav::MavState::POWEROFF:
      return "the autopilot shuts down";
    case mav::MavState::FLIGHT_TERMINATION:
      return "the autopilot has ended the flight";
    // A stream would bring OFFBOARD back by itself.
    case mav::MavState::CRITICAL:
    case mav::MavState::EMERGENCY:
      return "the autopilot is in a failsafe";
    case mav::MavState::BOOT:
    case mav::MavState::UNINIT:
      return "the autopilot starts";
    default:
      return "";
  }
}

std::string Autopilot::Warning(int64_t utime, double seconds) const {
  const bool recent = 1e-6 * static_cast<double>(utime - warned_utime_) <= seconds;
  std::string words;
  const auto add = [&](const std::string& text) { words += (words.empty() ? "" : ", ") + text; };
  if (recent) std::for_each(warnings_.begin(), warnings_.end(), add);
  std::for_each(failed_checks_.begin(), failed_checks_.end(), add);
  return words;
}

std::string Autopilot::Words(int64_t utime) const {
  static const char* const landed[] = {"unknown", "on ground", "in air", "taking off", "landing"};
  const auto state = static_cast<std::size_t>(Landed(utime));
  std::string words = fmt::format("mode {}, {}, {}", mode().name(), armed() ? "armed" : "disarmed",
                                  state < std::size(landed) ? landed[state] : "unknown");
  if (const Battery* battery = Emptiest(utime)) {
    words += fmt::format(", battery {} %", battery->percent);
    if (battery->volts > 0.0) words += fmt::format(" {:.1f} V", battery->volts);
  }
  if (channels_utime_ != 0)
    words += channels_ > 0 && !IsOld(channels_utime_, utime) ? ", receiver heard" : ", no receiver";
  return words;
}

}  // namespace chase::fcu
