#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/world/command_window.h"
#include "services/mission/inputs.h"
#include "services/mission/mission_config.h"
#include "services/mission/states.h"

namespace chase::mission {

/// The place that RETURN goes back to.
struct Home {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();  ///< p_WB where it took off, frame W, m
  int32_t epoch = 0;                            ///< of that frame W
};

/// How a mission process before this one led the flight when it was heard last.
struct Led {
  State state = State::kHold;
  double since = 0.0;  ///< when that state began, s
  std::string reason;  ///< what led to it
};

/// One command of one sender.
struct Command : world::CommandKey {
  Event kind = Event::kStop;
  bool force = false;  ///< says that it is meant
};

/// Leads a flight from switch-on to landing: commands and what is observed in, a state out.
class Mission {
 public:
  /// Commands from before `start` [s] are refused: whoever led the flight then has had them.
  Mission(const MissionConfig& config, double start) : config_(config), window_("mission", start) {}

  /// Written to as messages come.
  Inputs& inputs() { return inputs_; }

  /// Obeys or refuses a command that came at time `t` [s]. The same command again gets the same
  /// answer and changes nothing.
  world::CommandAnswer Obey(double t, const Command& command);

  /// Who outlived the mission process before this one says where that took off and how it led:
  /// unless somebody has commanded since, it goes on so.
  void Remember(double t, const Home& home, const Led& led);

  /// Moves on by what is observed at time `t` [s], which never goes back.
  void Update(double t);

  State state() const { return state_; }
  const std::string& reason() const { return reason_; }
  /// The reason and, while it is led to where it lands, what planning says of the ground there;
  /// in the air also who else flies.
  std::string Words() const;
  double since() const { return since_; }  ///< when the state began, s
  const std::optional<Home>& home() const { return home_; }
  const std::vector<std::string>& missing() const { return missing_; }
  const Inputs& inputs() const { return inputs_; }

 private:
  bool Step(double t, Event event, const std::string& detail = "");
  world::CommandAnswer Try(double t, const Command& command);
  std::string Refused(Event command) const;
  std::vector<Event> Breached() const;
  std::vector<Event> Unruly() const;
  void Overrule();
  void DropOverruled();
  void TakeOff(double t);
  std::vector<Event> Observed(double t) const;
  bool PoseIsLost(double t) const;
  bool IsUp() const;
  bool Flies() const;
  bool IsNotFlown(double t) const;
  bool IsSilent(const std::optional<double>& heard, double t) const;
  bool IsLandedByAutopilot() const;
  bool IsHome() const;
  bool KnowsHome() const;
  std::string Overridden(State to) const;
  bool IsLow() const;
  bool IsCritical() const;
  std::string Leaving() const;
  std::string Outside() const;
  std::string Detail(double t, Event event) const;
  void LeadItself(double t);
  void HearOfGround();
  void GoOn(double t, const Led& before, const char* when);
  void KeepHold(const Led& before);
  void GoOnWithoutPose(double t, const Led& led);
  void NoteProgress(double t);

  MissionConfig config_;
  bool uncommanded_ = true;  // nobody has commanded anything yet
  Inputs inputs_;
  world::CommandWindow window_;
  State state_ = State::kIdle;
  std::string reason_ = "switched on";
  std::string ground_;            // what planning said of it before control came down
  std::string refusal_;           // what the autopilot said of a take-off that was called off
  std::vector<Event> overruled_;  // breaches that `stop` overrules
  double since_ = 0.0;
  std::optional<double> taken_off_;    // when that was commanded, s
  std::optional<double> flown_;        // since when control has flown, s
  Led before_;                         // the emergency
  std::optional<double> last_usable_;  // pose, s
  std::optional<double> began_;  // the first Update(), s: the wait for a pose counts from there
  std::vector<Eigen::Vector3d> visited_;  // in this RETURN, frame W, m
  double progressed_ = 0.0;               // when the last of them was new, s
  std::optional<Home> home_;
  std::vector<std::string> missing_;
};

}  // namespace chase::mission
