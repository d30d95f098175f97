#pragma once

#include <string>

#include "logs/src/identification.h"

namespace chase::logs {

/// A table for people: every parameter with its uncertainty, and where it is not observable, which
/// flight would show it.
std::string Format(const Identification& identified);

/// What control has a parameter for and the flight shows, as a file for chase-control --config;
/// `origin` is said in its first line. Empty: nothing. Control's drag is along the axes of W; that
/// along B is taken for it, since a body in flight leans little. `present`: control's file today,
/// of which the drag along an axis is kept that the flight does not show; empty: without both there
/// is no drag. Throws what loading it throws.
std::string ControlFile(const Identification& identified, const std::string& origin,
                        const std::string& present = "");

}  // namespace chase::logs
