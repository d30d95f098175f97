#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace chase::compare {

struct Arguments {
  std::vector<std::string> planners;   ///< names, `name:set` or `name:all`; empty: the default five
  std::vector<std::string> scenarios;  ///< S1 to S12 or files; empty: the twelve
  int jobs = 1;
  std::string out = "compare";
  bool quiet = false;
  bool pictures = true;
};

/// One flight of a campaign, one process.
struct Job {
  std::string scenario;  ///< as given
  std::string planner;   ///< name or name:set
  std::string file;      ///< its result
};

/// Every pair of scenario and planner. Throws std::runtime_error or std::invalid_argument with one
/// line on a name that does not exist.
std::vector<Job> Jobs(const Arguments& arguments);

/// The command line of a job, for a shell.
std::string Command(const Job& job, const Arguments& arguments);

/// Flies one job in this process and writes its file.
void FlyJob(const Job& job);

/// Runs what is not done yet, `jobs` processes at a time, with a progress bar. A file counts as
/// done when it comes from this very program and scenario. Throws when a flight's process fails.
void Run(const std::vector<Job>& jobs, const Arguments& arguments);

}  // namespace chase::compare
