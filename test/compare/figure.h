#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace chase::compare {

using Flights = std::vector<nlohmann::ordered_json>;  ///< what FlightJson() makes

/// One of the figure's five panels.
struct Panel {
  std::string title;
  double (*value)(const nlohmann::ordered_json& metrics);
  bool logarithmic;
};
const std::vector<Panel>& Panels();

/// Scenarios and planners in order of appearance.
std::vector<std::string> ScenariosOf(const Flights& flights);
std::vector<std::string> PlannersOf(const Flights& flights);
/// Name as shown, `name:set` where a set was asked for.
std::string PlannerOf(const nlohmann::ordered_json& flight);
std::string ColorOf(const std::string& planner, size_t index);

/// comparison.png: five panels over the scenarios, one line per planner.
void DrawPanels(const Flights& flights, const std::string& file);

/// Top view of one scenario: obstacles, their growth by the drone's radius, every path.
void DrawTopView(const Flights& flights, const std::string& scenario, const std::string& file);

/// comparison.html: the same and the table, one page with Plotly inside.
void WritePage(const Flights& flights, const std::vector<std::string>& top_views,
               const std::string& file);

}  // namespace chase::compare
