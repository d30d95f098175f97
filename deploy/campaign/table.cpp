#include "deploy/campaign/table.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "deploy/campaign/judge.h"
#include "deploy/campaign/statistics.h"

namespace chase::campaign {
namespace {

using Json = nlohmann::ordered_json;
using Cells = std::vector<std::string>;

struct Column {
  const char* title;
  const char* outcome;
};
constexpr Column kCounts[] = {{"passed", outcome::kPassed},
                              {"collisions", outcome::kCollision},
                              {"target lost", outcome::kTargetLost},
                              {"odometry lost", outcome::kOdometryLost},
                              {"other", outcome::kOther},
                              {"errors", outcome::kError}};

std::string PlaceOf(const Json& flight) {
  return flight.contains("kind") ? "world:" + flight["kind"].get<std::string>()
                                 : flight["scenario"].get<std::string>();
}

std::string Count(const Row& row, const char* what) {
  const auto n = static_cast<long>(row.flights.size());
  const long k = std::count_if(row.flights.begin(), row.flights.end(),
                               [&](const Json* f) { return (*f)["outcome"] == what; });
  const Interval share = Wilson(k, n);
  return fmt::format("{} ({:.2f} to {:.2f})", k, share.low, share.high);
}

std::string Figure(const std::vector<double>& values, double figure) {
  return values.empty() ? "-" : fmt::format("{:.3f}", figure);
}

Cells CellsOf(const Row& row) {
  Cells cells = {row.place, row.fault, std::to_string(row.flights.size())};
  for (const Column& column : kCounts) cells.push_back(Count(row, column.outcome));
  const auto visible = Values(row, "visible_ratio"), clearance = Values(row, "min_clearance_m"),
             odometry = Values(row, "odometry_ate_m"), distance = Values(row, "distance_ratio");
  cells.push_back(Figure(visible, MeanOf(visible).mean));
  cells.push_back(Figure(
      clearance, clearance.empty() ? 0.0 : *std::min_element(clearance.begin(), clearance.end())));
  cells.push_back(Figure(odometry, Quantile(odometry, 0.95).value_or(0.0)));
  cells.push_back(Figure(distance, MeanOf(distance).mean));
  return cells;
}

std::string Markdown(const std::vector<Cells>& rows) {
  std::vector<size_t> widths(rows.front().size(), 3);
  for (const Cells& row : rows)
    for (size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  std::string text;
  for (size_t r = 0; r < rows.size(); ++r) {
    for (size_t i = 0; i < widths.size(); ++i)
      text += fmt::format("| {:<{}} ", rows[r][i], widths[i]);
    text += "|\n";
    if (r > 0) continue;
    for (const size_t width : widths) text += fmt::format("| {:-<{}} ", "", width);
    text += "|\n";
  }
  return text;
}

std::string FailedFlights(const std::vector<Json>& flights) {
  std::string text;
  for (const Json& f : flights) {
    if (f["outcome"] == outcome::kPassed) continue;
    const std::string fault = f["fault"];
    text += fmt::format("- {}, seed {}{}: {}\n  `{}`\n", PlaceOf(f), f["seed"].get<int64_t>(),
                        fault.empty() ? "" : ", " + fault, f["why"].get<std::string>(),
                        f["command"].get<std::string>());
  }
  return text.empty() ? "No flight failed.\n" : "Failed flights:\n\n" + text;
}

}  // namespace

std::vector<Row> RowsOf(const std::vector<Json>& flights) {
  std::vector<Row> rows;
  for (const Json& flight : flights) {
    const std::string place = PlaceOf(flight), fault = flight["fault"];
    auto row = std::find_if(rows.begin(), rows.end(),
                            [&](const Row& r) { return r.place == place && r.fault == fault; });
    if (row == rows.end()) row = rows.insert(rows.end(), {place, fault, {}});
    row->flights.push_back(&flight);
  }
  return rows;
}

std::vector<double> Values(const Row& row, const std::string& key) {
  std::vector<double> values;
  for (const Json* flight : row.flights) {
    const auto at = flight->find(key);
    if (at != flight->end() && at->is_number() && std::isfinite(at->get<double>()))
      values.push_back(*at);
  }
  return values;
}

std::string Table(const std::vector<Json>& flights) {
  std::vector<Cells> rows = {{"scenario", "fault", "flights"}};
  for (const Column& column : kCounts) rows[0].push_back(column.title);
  for (const char* title :
       {"visible, mean", "clearance, worst [m]", "odometry error, p95 [m]", "distance ratio, mean"})
    rows[0].push_back(title);
  Row pooled{"all", "", {}};
  for (const Row& row : RowsOf(flights)) {
    rows.push_back(CellsOf(row));
    pooled.flights.insert(pooled.flights.end(), row.flights.begin(), row.flights.end());
  }
  rows.push_back(CellsOf(pooled));
  return Markdown(rows) + "\nIn brackets: 95 % Wilson intervals of the share.\n\n" +
         FailedFlights(flights);
}

}  // namespace chase::campaign
