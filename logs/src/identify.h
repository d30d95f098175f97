#pragma once

#include <string>
#include <vector>

#include "common/config/edit.h"
#include "logs/src/identification.h"
#include "services/control/control_config.h"
#include "services/fcu/fcu_config.h"
#include "services/planning/planning_config.h"

namespace chase::logs {

/// A table for people: every parameter with its uncertainty, and where it is not observable, which
/// flight would show it.
std::string Format(const Identification& identified);

/// Sets what control has a parameter for and the flight shows. Control's drag is along the axes of
/// W; that along B is taken for it, since a body in flight leans little. `keeps`: an axis whose
/// drag the flight does not show keeps its own; otherwise no drag is set then.
std::vector<config::Change> SetInControl(const Identification& identified, bool keeps,
                                         control::ControlConfig* config);

/// Sets the drag along the ground, which planning tilts the body by. Nothing where the flight does
/// not show it.
std::vector<config::Change> SetInPlanning(const Identification& identified,
                                          planning::PlanningConfig* config);

/// Sets the thrust curve of `config`, by which the flight was flown, so that chase-fcu's command
/// gives the thrust that is asked for, and the slope at the hover. Nothing where the flight does
/// not show the thrust; the curve stays where it does not show that.
std::vector<config::Change> SetInFcu(const Identification& identified, fcu::FcuConfig* config);

/// What SetInControl sets, as a file for chase-control --config;
/// `origin` is said in its first line. Empty: nothing. `present`: control's file today, which keeps
/// its drag along an axis. Throws what loading it throws.
std::string ControlFile(const Identification& identified, const std::string& origin,
                        const std::string& present = "");

}  // namespace chase::logs
