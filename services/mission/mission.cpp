#include "services/mission/mission.h"

#include <algorithm>

#include "common/world/ages.h"

namespace chase::mission {

namespace {

bool Has(const std::vector<Event>& events, Event event) {
  return std::find(events.begin(), events.end(), event) != events.end();
}

const char* StopReason() { return Find(State::kHold, Event::kStop)->reason; }

bool IsStop(const Led& led) {
  return led.state == State::kHold && led.reason.rfind(StopReason(), 0) == 0;
}

/// What an emergency tells of what it breaks off, in the format of flight_state_t.lcm: HOME brings
/// it to the next mission process.
std::string TellBrokenOff(const Led& led) {
  const std::string words = "broke off " + std::string(Name(led.state));
  return IsStop(led) ? words + ": " + StopReason() : words;
}

/// What goes on after an emergency of that reason.
std::optional<Led> ReadBrokenOff(const std::string& reason) {
  for (const Led& led : {Led{State::kLand, 0.0, ""}, Led{State::kReturn, 0.0, ""},
                         Led{State::kHold, 0.0, StopReason()}, Led{State::kHold, 0.0, ""}})
    if (reason.find(TellBrokenOff(led)) != std::string::npos) return led;
  return std::nullopt;
}

}  // namespace

world::CommandAnswer Mission::Obey(double t, const Command& command) {
  const bool urgent = command.kind == Event::kStop || command.kind == Event::kKill;
  return window_.Take(
      t, command, [&] { return Try(t, command); }, urgent);
}

world::CommandAnswer Mission::Try(double t, const Command& command) {
  if (std::string refusal = Refused(command.kind); !refusal.empty()) return {false, refusal};
  // The bridge does not cut them then, whatever is sent.
  if (command.kind == Event::kKill && inputs_.autopilot.rfind("pilot", 0) == 0)
    return {false, "a pilot has it: his kill switch cuts the motors"};
  if (command.kind == Event::kKill && !command.force)
    return {false, "kill cuts the motors wherever it is, and it falls: say so with --force"};
  Step(t, command.kind);
  if (state_ == State::kReturn && !KnowsHome()) Step(t, Event::kHomeLost);
  uncommanded_ = false;
  overruled_.clear();
  if (command.kind == Event::kStop) Overrule();
  return {true, std::string(Name(state_)) + ": " + reason_};
}

std::string Mission::Refused(Event command) const {
  if (const Transition* row = Find(state_, command))
    return command == Event::kStop ? "" : Overridden(row->to);
  std::string reason = std::string(Name(command)) + " in " + Name(state_) + ": " + Refusal(state_);
  const char* separator = ": ";
  if (state_ != State::kIdle) return reason;
  for (const std::string& what : missing_) {
    reason += separator + what;
    separator = ", ";
  }
  return reason;
}

/// Why the safety envelope would not leave it in that state; empty: it would.
std::string Mission::Overridden(State to) const {
  if (to == State::kDone || to == State::kLand) return "";
  if (IsCritical()) return "the battery is critical: it only lands";
  if (to == State::kReturn) return "";
  if (IsLow()) return "the battery is low: it returns or lands";
  if (to == State::kTakeoff) return "";  // from there the fence counts anew
  if (const std::string outside = Outside(); !outside.empty())
    return "it is " + outside + ": it returns, lands or stops";
  const bool leads_about = to == State::kChase || to == State::kSearch;
  return leads_about && config_.geofence.Exists() && !KnowsHome()
             ? "the take-off place is not known, nor the geofence"
             : "";
}

bool Mission::Step(double t, Event event, const std::string& detail) {
  const Transition* row = Find(state_, event);
  if (row == nullptr) return false;
  if (row->to == State::kEmergency) before_ = {state_, since_, reason_};
  if (row->to != state_) since_ = t;
  if (row->to == State::kReturn) visited_.clear();
  state_ = row->to;
  reason_ = row->reason + (detail.empty() ? "" : ": " + detail);
  if (event == Event::kNotFlown) refusal_ = inputs_.autopilot;
  if (event == Event::kTakeoff) TakeOff(t);
  return true;
}

void Mission::TakeOff(double t) {
  taken_off_ = t;
  flown_.reset();
  refusal_.clear();
  inputs_.way.clear();  // of another flight, with its fence about another place
  if (inputs_.pose) home_ = Home{inputs_.pose->p, inputs_.pose->epoch};
}

void Mission::Update(double t) {
  if (!began_) began_ = since_ = t;
  if (inputs_.pose && inputs_.pose->usable)
    last_usable_ = std::max(last_usable_.value_or(inputs_.pose->t), inputs_.pose->t);
  missing_ = Missing(config_, inputs_, t);
  if (!IsAirborne(state_) && inputs_.armed && !inputs_.on_ground)
    missing_.emplace_back("the autopilot says that it is in the air");
  if (!flown_ && IsAirborne(state_) && Flies()) flown_ = t;
  NoteProgress(t);
  DropOverruled();
  for (const Event event : Observed(t)) {
    const bool stepped = Step(t, event, Detail(t, event));
    if (stepped && (event == Event::kLeaving || event == Event::kNotFlown))
      uncommanded_ = false;  // it would come to the same again
    if (stepped && event == Event::kPoseBack) GoOn(t, before_, "before the pose was lost");
  }
  if (uncommanded_ && config_.autostart) LeadItself(t);
  HearOfGround();
}

void Mission::Remember(double t, const Home& home, const Led& led) {
  if (home_) return;
  const bool emergency = led.state == State::kEmergency;
  if (emergency && !last_usable_ && began_) GoOnWithoutPose(t, led);
  if (!IsAirborne(state_)) return;
  home_ = home;
  if (!uncommanded_ || state_ == State::kEmergency) return;
  const char* const when = "before this process started";
  // It may have come to land for want of the take-off place or the pose alone: what else it lands
  // for, stands.
  if (state_ == State::kLand && (emergency || !inputs_.landing)) Step(t, Event::kHold, when);
  if (const std::optional<Led> before = emergency ? ReadBrokenOff(led.reason) : led) {
    if (before->state == State::kHold) Step(t, Event::kHold, when);  // autostart may have chased
    GoOn(t, *before, when);
    KeepHold(*before);
  }
  if (led.state == State::kChase) Step(t, Event::kChase, when);
  if (led.state == State::kSearch) Step(t, Event::kSearch, when);
  if (state_ == led.state) since_ = std::min(t, led.since);
}

/// An emergency lasts until somebody hears a pose to fly by, however long nobody was there to tell
/// of it. Control may be silent by then.
void Mission::GoOnWithoutPose(double t, const Led& led) {
  Step(t, Event::kFlying);
  Step(t, Event::kPoseLost, Detail(t, Event::kPoseLost));
  if (state_ != State::kEmergency) return;
  began_ = -HUGE_VAL;
  since_ = std::min(t, led.since);
  if (!uncommanded_) return;
  const std::optional<Led> before = ReadBrokenOff(led.reason);
  if (before) KeepHold(*before);
  before_ = before.value_or(Led{});
  reason_ = led.reason.substr(0, led.reason.find("; "));  // the rest is Words() of its time
}

/// What was led before goes on; but for a stop, what held needs no more than HOLD.
void Mission::GoOn(double t, const Led& before, const char* when) {
  if (before.state == State::kLand) Step(t, Event::kLand, when);
  if (before.state == State::kReturn) Step(t, Event::kReturn, when);
  if (IsStop(before)) Step(t, Event::kStop, when);
}

/// Of a process before this one: a stop overrules the limits that it is found beyond, and whoever
/// told it to hold leads.
void Mission::KeepHold(const Led& before) {
  if (before.state != State::kHold) return;
  if (IsStop(before)) Overrule();
  uncommanded_ = false;
}

// The way home may lead away from it first, around a corner of the geofence; to and fro, and down
// or up, it leads to no end.
void Mission::NoteProgress(double t) {
  constexpr double kElsewhere = 0.3;  // m, beyond what the pose wavers by
  if (state_ != State::kReturn || !inputs_.pose) return;
  const Eigen::Vector3d& p = inputs_.pose->p;
  for (const Eigen::Vector3d& place : visited_)
    if ((place - p).head<2>().norm() < kElsewhere) return;
  visited_.push_back(p);
  progressed_ = t;
}

// In the order in which they count; each moves the state that the one before has led to.
std::vector<Event> Mission::Observed(double t) const {
  std::vector<Event> events;
  const auto add = [&events](bool holds, Event event) {
    if (holds) events.push_back(event);
  };
  add(inputs_.motors_off, Event::kMotorsOff);
  add(IsLandedByAutopilot(), Event::kDisarmed);
  add(inputs_.landing, Event::kLanding);
  add(Flies(), Event::kFlying);
  events.push_back(PoseIsLost(t) ? Event::kPoseLost : Event::kPoseBack);
  events.push_back(missing_.empty() ? Event::kComplete : Event::kMissing);
  events.push_back(SeesTarget(inputs_, t) ? Event::kSeen : Event::kLost);
  add(state_ == State::kTakeoff && IsUp(), Event::kUp);
  add(IsNotFlown(t), Event::kNotFlown);
  add(state_ == State::kSearch && config_.give_up > 0.0 && t - since_ > config_.give_up,
      Event::kGaveUp);
  add(IsSilent(inputs_.plan_heard, t), Event::kUnplanned);
  add(IsSilent(inputs_.obstacles, t), Event::kUnmapped);
  add(!Leaving().empty(), Event::kLeaving);
  for (const Event breach : Unruly()) events.push_back(breach);
  add(!KnowsHome(), Event::kHomeLost);
  add(IsHome(), Event::kHome);
  add(state_ == State::kReturn && config_.return_patience > 0.0 &&
          t - progressed_ > config_.return_patience,
      Event::kStuck);
  return events;
}

/// Limits of the envelope that it is beyond.
std::vector<Event> Mission::Breached() const {
  std::vector<Event> breached;
  if (!Outside().empty()) breached.push_back(Event::kOutside);
  if (IsLow()) breached.push_back(Event::kBatteryLow);
  if (IsCritical()) breached.push_back(Event::kBatteryCritical);
  return breached;
}

/// Those of them that no `stop` overrules.
std::vector<Event> Mission::Unruly() const {
  std::vector<Event> breached = Breached();
  const auto is_overruled = [this](Event e) { return Has(overruled_, e); };
  breached.erase(std::remove_if(breached.begin(), breached.end(), is_overruled), breached.end());
  return breached;
}

/// The limits that it is beyond, and those of which a process that has just started cannot tell.
void Mission::Overrule() {
  overruled_ = {Event::kOutside, Event::kBatteryLow, Event::kBatteryCritical};
  DropOverruled();
}

/// What it is known not to be beyond counts once more.
void Mission::DropOverruled() {
  const std::vector<Event> breached = Breached();
  const auto ends = [&](Event e) {
    const bool known = e == Event::kOutside ? KnowsHome() : inputs_.battery.has_value();
    return known && !Has(breached, e);
  };
  overruled_.erase(std::remove_if(overruled_.begin(), overruled_.end(), ends), overruled_.end());
}

std::string Mission::Detail(double t, Event event) const {
  if (event == Event::kMissing) return missing_.front();
  if (event == Event::kPoseLost) return TellBrokenOff({state_, since_, reason_});
  if (event == Event::kLost) return ForecastProblem(inputs_, t);
  if (event == Event::kNotFlown && !Unruly().empty())
    return Has(Unruly(), Event::kOutside) ? Outside() : "battery low";
  if (event == Event::kDisarmed) return inputs_.autopilot;
  if (event == Event::kLeaving) return Leaving();
  return event == Event::kOutside ? Outside() : "";
}

bool Mission::IsLow() const {
  return inputs_.battery && config_.battery_low > 0.0 && *inputs_.battery <= config_.battery_low;
}

bool Mission::IsCritical() const {
  return inputs_.battery && config_.battery_critical > 0.0 &&
         *inputs_.battery <= config_.battery_critical;
}

// The fence counts from the take-off place: where that is not known any more nothing leads about.
std::string Mission::Leaving() const {
  if (!config_.geofence.Exists()) return "";
  if (!KnowsHome()) return "the take-off place is not known";
  for (const Eigen::Vector3d& p : inputs_.way)
    if (std::string breach = config_.geofence.Breach(p - home_->p); !breach.empty()) return breach;
  return "";
}

std::string Mission::Outside() const {
  return KnowsHome() ? config_.geofence.Breach(inputs_.pose->p - home_->p) : "";
}

std::string Mission::Words() const {
  const std::string words = reason_ + (ground_.empty() ? "" : "; " + ground_);
  const std::string others = !IsAirborne(state_)   ? refusal_
                             : inputs_.handed_over ? inputs_.autopilot
                                                   : "";
  return others.empty() ? words : words + "; fcu: " + others;
}

void Mission::HearOfGround() {
  if (state_ != State::kLand)
    ground_.clear();
  else if (!inputs_.landing && inputs_.plan_reason.rfind("landing", 0) == 0)
    ground_ = inputs_.plan_reason;
}

// By then control comes down by itself.
bool Mission::PoseIsLost(double t) const {
  return t - last_usable_.value_or(*began_) > world::kMostAge.velocity;
}

// At rest at the end of a plan that was made since, and that far up: a plan may also end where it
// stands.
bool Mission::IsUp() const {
  constexpr double kAtEnd = 0.1;  // m: several times what control is off while it climbs
  const std::optional<PoseReport>& pose = inputs_.pose;
  return pose && inputs_.plan_heard > since_ && (pose->p - inputs_.plan_end).norm() < kAtEnd &&
         pose->v.norm() < config_.rest_speed &&
         (!KnowsHome() || pose->p.z() - home_->p.z() > 0.5 * config_.climb_height);
}

// While the autopilot is silent control follows its plan on the ground, too: a take-off that was
// commanded here is flown once the autopilot says that it is armed. A mission that was started in
// flight has commanded none and goes by control alone.
bool Mission::Flies() const { return inputs_.flying && (flown_ || !taken_off_ || inputs_.armed); }

// What the bridge has given up lasts until setpoints cease; its status may be that old.
bool Mission::IsNotFlown(double t) const {
  if (!IsAirborne(state_) || flown_ || !inputs_.on_ground) return false;
  if (!Unruly().empty()) return true;  // a return would land at once, and be over
  const double waited = t - taken_off_.value_or(0.0);
  if (inputs_.handed_over) return waited > world::kMostAge.status;
  return config_.takeoff_patience > 0.0 && waited > config_.takeoff_patience;
}

// Without plans control hovers at the end of the last stop, and comes down without one once it is
// told to; without obstacles planning plans no more than that.
bool Mission::IsSilent(const std::optional<double>& heard, double t) const {
  return flown_ && t - std::max(heard.value_or(*flown_), *flown_) > world::kMostAge.plan;
}

// DONE cuts the motors: "disarmed" must not count in a status that was sent before the flight, and
// that may be the newest for as long as those after it are lost.
bool Mission::IsLandedByAutopilot() const {
  return flown_ && inputs_.disarmed && *inputs_.disarmed - *flown_ > world::kMostAge.status;
}

bool Mission::KnowsHome() const {
  return home_ && inputs_.pose && home_->epoch == inputs_.pose->epoch;
}

bool Mission::IsHome() const {
  if (!KnowsHome()) return false;
  const PoseReport& pose = *inputs_.pose;
  return (pose.p - home_->p).head<2>().norm() < config_.home_radius &&
         pose.v.norm() < config_.rest_speed;
}

// As an operator would who wants to see a chase.
void Mission::LeadItself(double t) {
  if (state_ == State::kReady)
    Step(t, Event::kTakeoff, "autostart");
  else if (state_ == State::kTakeoff || state_ == State::kHold)
    Step(t, Event::kChase, "autostart");
}

}  // namespace chase::mission
