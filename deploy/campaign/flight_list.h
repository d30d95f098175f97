#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace chase::campaign {

/// One flight of a campaign. Two flights are a pair when all but `file` is equal.
struct Flight {
  std::string scenario;  ///< the file's name without folder and ending; hall-7 for a random world
  std::string kind;      ///< of a random world; empty: a scenario file
  std::string file;      ///< the scenario file; empty for a random world
  std::string fault;     ///< NAME or NAME@SECONDS; empty: none
  int64_t seed = 1;

  /// What a table's row is called: the scenario, or world:KIND.
  std::string Place() const { return kind.empty() ? scenario : "world:" + kind; }
  /// For people and as a file's name; no two flights of a campaign share it.
  std::string Name() const;
};

/// What the command line asks for.
struct Request {
  std::vector<std::string> scenarios;  ///< names, files, or world:KIND
  std::vector<std::string> kinds;      ///< of random worlds; `all`: every one
  std::vector<std::string> faults;     ///< `none`, `all` that can strike, or names; empty: none
  std::string seeds = "1";             ///< such as 1-20 or 1,5,9
  std::string flights_file;            ///< instead of all others
};

/// The kinds of random worlds that chase-world makes.
const std::vector<std::string>& Kinds();

/// Every flight that is asked for, each once. Throws std::runtime_error with one line that names
/// what is wrong: a name, a seed, a line of the list.
std::vector<Flight> Flights(const Request& request);

/// Such as "1-3,9": 1 2 3 9. Throws std::runtime_error with one line.
std::vector<int64_t> Seeds(const std::string& text);

}  // namespace chase::campaign
