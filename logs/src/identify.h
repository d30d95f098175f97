#pragma once

#include <string>

#include "logs/src/identification.h"

namespace chase::logs {

/// A table for people: every parameter with its uncertainty, and where a flight does not tell one,
/// why, and which flight would.
std::string Format(const Identification& identified);

/// What control has a parameter for and the flight tells, as a file for chase-control --config;
/// `origin` is said in its first line. Empty: nothing.
std::string ControlFile(const Identification& identified, const std::string& origin);

}  // namespace chase::logs
