#pragma once

#include <functional>
#include <string>
#include <vector>

namespace chase::campaign {

/// One flight of a campaign: a process of its own that leaves one file.
struct Job {
  std::string name;                  ///< for people
  std::vector<std::string> command;  ///< program and arguments
  std::string file;                  ///< its result: JSON with the key `fingerprint`
  std::string fingerprint;           ///< of all that the flight depends on
};

struct RunOptions {
  int jobs = 1;  ///< processes at a time
  bool quiet = false;
  /// Whether the result of a job that is done counts as a failed flight on the progress line.
  std::function<bool(const Job&)> failed = [](const Job&) { return false; };
};

/// Whether the job's file is there and comes from the same fingerprint.
bool IsDone(const Job& job);

/// Makes the folder `out`/flights. Throws std::runtime_error, one line, where it cannot be written.
void MakeFolder(const std::string& out);

/// Runs what is not done yet, with a progress bar. A process that leaves no result ends the run:
/// what flies is waited for and kept, then std::runtime_error with one line is thrown.
void Run(const std::vector<Job>& jobs, const RunOptions& options);

}  // namespace chase::campaign
