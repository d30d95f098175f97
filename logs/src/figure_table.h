#pragma once

#include <optional>
#include <string>
#include <vector>

namespace chase::logs {

enum class Better { kHigher, kLower, kNearOne };

/// How reports show a figure of metrics.json.
struct ShownFigure {
  const char* key;  ///< parts joined by a point
  const char* words;
  const char* unit;              ///< empty: none
  double scale;                  ///< from the key's unit to the shown one
  int digits;                    ///< behind the point
  std::optional<Better> better;  ///< none: it only describes a flight

  /// `value` is in the key's unit.
  std::string Text(double value) const;
  /// Half of the last digit that is shown, in the key's unit.
  double HalfDigit() const;
};

/// In the order of the reports.
const std::vector<ShownFigure>& FigureTable();

}  // namespace chase::logs
