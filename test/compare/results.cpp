#include "test/compare/results.h"

#include <fmt/format.h>

#include <filesystem>
#include <stdexcept>

#include "deploy/campaign/text_file.h"
#include "test/compare/figure.h"

namespace chase::compare {
namespace {

using Json = nlohmann::ordered_json;

const std::vector<std::string> kColumns = {"scenario",
                                           "planner",
                                           "parameter_set",
                                           "seed",
                                           "safe_ratio",
                                           "visible_ratio",
                                           "visible_ratio_physical",
                                           "min_clearance_m",
                                           "min_sight_clearance_m",
                                           "proved_safe",
                                           "distance_ratio",
                                           "distance_error",
                                           "travel_ratio",
                                           "acceleration_cost",
                                           "jerk_cost",
                                           "yaw_rate_rms",
                                           "peak_speed",
                                           "peak_acceleration",
                                           "replans",
                                           "fallbacks"};

std::string Csv(const std::vector<Json>& flights) {
  std::string text;
  for (const std::string& column : kColumns) text += column + ",";
  text += "plan_ms_mean,plan_ms_p95,plan_ms_max,plan_cpu_ms_mean\n";
  for (const Json& flight : flights) {
    const Json& m = flight["metrics"];
    for (const std::string& column : kColumns)
      text += (!m.contains(column)     ? ""
               : m[column].is_string() ? m[column].get<std::string>()
                                       : m[column].dump()) +
              std::string(",");
    text += fmt::format("{:.6g},{:.6g},{:.6g},{:.6g}\n", m["plan_ms"]["mean"].get<double>(),
                        m["plan_ms"]["p95"].get<double>(), m["plan_ms"]["max"].get<double>(),
                        m["plan_cpu_ms"]["mean"].get<double>());
  }
  return text;
}

void PrintTable(const std::vector<Json>& flights) {
  fmt::print("{:<12} {:<18} {:>6} {:>8} {:>9} {:>9} {:>11} {:>10}\n", "scenario", "planner", "safe",
             "visible", "distance", "travel", "accel cost", "plan [ms]");
  for (const Json& flight : flights) {
    const Json& m = flight["metrics"];
    std::string planner = m["planner"];
    if (m.contains("parameter_set")) planner += fmt::format(":{}", m["parameter_set"].get<int>());
    fmt::print("{:<12} {:<18} {:6.4f} {:8.4f} {:9.3f} {:9.3f} {:11.4f} {:10.3f}\n",
               m["scenario"].get<std::string>(), planner, m["safe_ratio"].get<double>(),
               m["visible_ratio"].get<double>(), m["distance_ratio"].get<double>(),
               m["travel_ratio"].get<double>(), m["acceleration_cost"].get<double>(),
               m["plan_ms"]["mean"].get<double>());
  }
}

/// The pictured ones among the twelve; the last scenario where none of them was flown.
std::vector<std::string> Pictured(const std::vector<std::string>& scenarios) {
  std::vector<std::string> pictured;
  for (const std::string& s : scenarios)
    if (s == "S3" || s == "S6" || s == "S9" || s == "S12") pictured.push_back(s);
  if (pictured.empty()) pictured.push_back(scenarios.back());
  return pictured;
}

void DrawAll(const std::vector<Json>& flights, const std::filesystem::path& folder) {
  DrawPanels(flights, (folder / "comparison.png").string());
  const auto pictured = Pictured(ScenariosOf(flights));
  for (const std::string& scenario : pictured)
    DrawTopView(flights, scenario, (folder / ("top_view_" + scenario + ".png")).string());
  WritePage(flights, pictured, (folder / "comparison.html").string());
}

}  // namespace

std::vector<nlohmann::ordered_json> ReadFlights(const std::vector<Flight>& flown) {
  std::vector<Json> flights;
  for (const Flight& flight : flown)
    flights.push_back(Json::parse(campaign::ReadText(flight.file)));
  return flights;
}

void WriteResults(const std::vector<Flight>& flown, const Arguments& arguments) {
  const std::filesystem::path folder(arguments.out);
  const std::vector<Json> flights = ReadFlights(flown);
  Json list = Json::array();
  for (const Json& flight : flights) list.push_back(flight["metrics"]);
  campaign::WriteText((folder / "flights.json").string(), list.dump(1) + "\n");
  campaign::WriteText((folder / "flights.csv").string(), Csv(flights));
  PrintTable(flights);
  if (!arguments.pictures) return;
  try {
    DrawAll(flights, folder);
    fmt::print("{}\n", (folder / "comparison.html").string());
  } catch (const std::exception& e) {
    fmt::print(stderr, "chase-compare: no pictures: {}\n", e.what());
  }
}

}  // namespace chase::compare
