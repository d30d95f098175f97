#pragma once

#include <array>
#include <string>

namespace chase::baselines {

/// Parameter set `number` (1..20) of FOLDER/sets.csv; 0: the one that FOLDER/best.csv names for the
/// scenario, else the one that is best over all. `folder` is relative to test/baselines. Throws
/// std::runtime_error with one line when a file is damaged.
std::array<double, 4> ParameterSet(const std::string& folder, int number,
                                   const std::string& scenario);
constexpr int kParameterSets = 20;

}  // namespace chase::baselines
