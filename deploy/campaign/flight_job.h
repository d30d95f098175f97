#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "deploy/campaign/flight_list.h"
#include "deploy/campaign/jobs.h"

namespace chase::campaign {

/// What holds for all flights of a campaign.
struct Setup {
  std::string out;       ///< folder of the results
  std::string programs;  ///< folder of chase-flight, chase-world and, for reports, chase-report
  double duration = -1;  ///< s of the mission; negative: the scenario's, the kind's
  bool fly_on = false;   ///< after a collision
};

/// The flights as processes of this very program. Throws std::runtime_error, one line, where a
/// program or a scenario cannot be read.
std::vector<Job> Jobs(const std::vector<Flight>& flights, const Setup& setup);

/// Flies one flight in a process of chase-flight and writes its job's file: `fingerprint`, `ended`
/// (why there are no metrics; empty: there are) and `metrics`, and beside it the report of a flight
/// that failed. Leaves a job that is done as it is.
void Fly(const Flight& flight, const Job& job, const Setup& setup);

/// The page of a flight that failed, from the folder `out`; empty: there is none.
std::string ReportOf(const Flight& flight, const Setup& setup);

/// The line for a shell that repeats a flight; a random world is written where the line is run.
std::string RepeatLine(const Flight& flight, const Setup& setup);

}  // namespace chase::campaign
