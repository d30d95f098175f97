#pragma once

#include <string>
#include <vector>

#include "deploy/campaign/jobs.h"

namespace chase::compare {

struct Arguments {
  std::vector<std::string> planners;   ///< names, `name:set` or `name:all`; empty: the default five
  std::vector<std::string> scenarios;  ///< S1 to S12 or files; empty: the twelve
  int jobs = 1;
  std::string out = "compare";
  bool quiet = false;
  bool pictures = true;
};

/// One flight of a comparison.
struct Flight {
  std::string scenario;  ///< as given
  std::string planner;   ///< name or name:set
  std::string file;      ///< its result
};

/// Every pair of scenario and planner. Throws std::runtime_error or std::invalid_argument with one
/// line on a name that does not exist.
std::vector<Flight> FlightsOf(const Arguments& arguments);

/// The flights as processes of this very program. A file counts as done when it comes from the
/// same program and scenario.
std::vector<campaign::Job> Jobs(const std::vector<Flight>& flights);

/// Flies one flight in this process and writes its file.
void Fly(const Flight& flight);

}  // namespace chase::compare
