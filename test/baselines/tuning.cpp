#include "test/baselines/tuning.h"

#include <cstdio>
#include <fstream>
#include <stdexcept>

namespace chase::baselines {
namespace {

std::ifstream Open(const std::string& file) {
  std::ifstream in(file);
  if (!in) throw std::runtime_error(file + ": cannot be read; check the path and its rights");
  return in;
}

int BestSet(const std::string& file, const std::string& scenario) {
  std::ifstream in = Open(file);
  int overall = 1;
  for (std::string line; std::getline(in, line);) {
    const size_t comma = line.find(',');
    int set = 0;
    if (comma == std::string::npos || std::sscanf(line.c_str() + comma, ",%d", &set) != 1) continue;
    if (line.compare(0, comma, scenario) == 0) return set;
    if (line.compare(0, comma, "overall") == 0) overall = set;
  }
  return overall;
}

}  // namespace

std::array<double, 4> ParameterSet(const std::string& folder, int number,
                                   const std::string& scenario) {
  const std::string home = std::string(CHASE_BASELINES) + "/" + folder + "/";
  if (number == 0) number = BestSet(home + "best.csv", scenario);
  std::ifstream in = Open(home + "sets.csv");
  for (std::string line; std::getline(in, line);) {
    int set = 0;
    std::array<double, 4> v{};
    if (std::sscanf(line.c_str(), "%d,%lf,%lf,%lf,%lf", &set, &v[0], &v[1], &v[2], &v[3]) == 5 &&
        set == number)
      return v;
  }
  throw std::runtime_error(home + "sets.csv: has no set " + std::to_string(number) +
                           "; restore the file");
}

}  // namespace chase::baselines
