#pragma once

#include <string>
#include <vector>

namespace chase::logs {

/// One figure of two flights. Empty texts: not known.
struct ComparedFigure {
  std::string key, a, b;  ///< key of metrics.json, parts joined by a point
  bool worse = false;     ///< of b
};

/// The figures of two flights' metrics.json that have a better side, and the criteria. A figure is
/// worse where it has moved to its worse side by more than `tolerance` of the larger of the two and
/// by more than half of the last digit that is shown; a criterion, null where it is not known,
/// where it held and does not any more. What is not known of one of them is not worse.
std::vector<ComparedFigure> CompareMetrics(const std::string& a, const std::string& b,
                                           double tolerance);

/// A table, WORSE beside what is; then how many are, and how many are known of A and not of B.
std::string Format(const std::vector<ComparedFigure>& figures);

}  // namespace chase::logs
