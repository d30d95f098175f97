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

/// The rows that flights belong to, in the order of their first flight.
template <class RowOf>
std::vector<Row> Grouped(const std::vector<Json>& flights, const RowOf& row_of) {
  std::vector<Row> rows;
  for (const Json& flight : flights) {
    const Row of = row_of(flight);
    auto row = std::find_if(rows.begin(), rows.end(), [&](const Row& r) {
      return r.place == of.place && r.fault == of.fault;
    });
    if (row == rows.end()) row = rows.insert(rows.end(), of);
    row->flights.push_back(&flight);
  }
  return rows;
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

std::string Mean(const Row& row, const char* key) {
  const auto values = Values(row, key);
  return Figure(values, MeanOf(values).mean);
}

std::string Highest(const Row& row, const char* key) {
  const auto values = Values(row, key);
  return Figure(values, values.empty() ? 0.0 : *std::max_element(values.begin(), values.end()));
}

std::string Lowest(const Row& row, const char* key) {
  const auto values = Values(row, key);
  return Figure(values, values.empty() ? 0.0 : *std::min_element(values.begin(), values.end()));
}

/// A fault of it ended and the flight did not recover from it.
bool NeverRecovered(const Json& flight) {
  const Json faults = flight.value("faults", Json::array());
  return std::any_of(faults.begin(), faults.end(), [](const Json& fault) {
    return fault.is_object() && fault.value("end_s", Json()).is_number() &&
           !fault.value("recovery_s", Json()).is_number();
  });
}

std::string Recovery(const Row& row) {
  const auto never = std::count_if(row.flights.begin(), row.flights.end(),
                                   [](const Json* flight) { return NeverRecovered(*flight); });
  return Highest(row, "recovery_s") + (never > 0 ? fmt::format(", {} never", never) : "");
}

std::string Sum(const Row& row, const char* key) {
  const auto values = Values(row, key);
  double sum = 0.0;
  for (const double value : values) sum += value;
  return values.empty() ? "-" : fmt::format("{:.0f}", sum);
}

Cells CellsOf(const Row& row) {
  Cells cells = {row.place, row.fault, std::to_string(row.flights.size())};
  for (const Column& column : kCounts) cells.push_back(Count(row, column.outcome));
  const auto odometry = Values(row, "odometry_ate_m");
  cells.push_back(Mean(row, "visible_ratio"));
  cells.push_back(Lowest(row, "min_clearance_m"));
  cells.push_back(Figure(odometry, Quantile(odometry, 0.95).value_or(0.0)));
  cells.push_back(Mean(row, "distance_ratio"));
  cells.push_back(Lowest(row, "visible_ratio"));
  cells.push_back(Mean(row, "in_image_ratio"));
  cells.push_back(Mean(row, "travel_ratio"));
  cells.push_back(Mean(row, "certificate_kept_ratio"));
  cells.push_back(Highest(row, "reaction_s"));
  cells.push_back(Recovery(row));
  for (const char* key :
       {"nonfinite_setpoints", "plans_in_air", "uncertified_brakes", "accelerating_brakes"})
    cells.push_back(Sum(row, key));
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

/// The faults of any process, or any channel, are one kind.
std::string KindOf(const std::string& fault) {
  const std::string effect = fault.substr(0, fault.find('-') + 1);
  if (effect == "kill-" || effect == "freeze-") return effect + "P";
  return effect == "delay-" ? effect + "C" : fault;
}

/// Each kind of fault over all places.
std::vector<Row> FaultsOf(const std::vector<Json>& flights) {
  return Grouped(flights, [](const Json& f) { return Row{"all", KindOf(f["fault"]), {}}; });
}

std::string FailedFlights(const std::vector<Json>& flights) {
  std::string text;
  for (const Json& f : flights) {
    if (f["outcome"] == outcome::kPassed) continue;
    const std::string fault = f["fault"], report = f.value("report", std::string());
    text += fmt::format("- {}, seed {}{}: {}\n  {}`{}`\n", PlaceOf(f), f["seed"].get<int64_t>(),
                        fault.empty() ? "" : ", " + fault, f["why"].get<std::string>(),
                        report.empty() ? "" : fmt::format("[report]({}), ", report),
                        f["command"].get<std::string>());
  }
  return text.empty() ? "No flight failed.\n" : "Failed flights:\n\n" + text;
}

}  // namespace

std::vector<Row> RowsOf(const std::vector<Json>& flights) {
  return Grouped(flights, [](const Json& f) { return Row{PlaceOf(f), f["fault"], {}}; });
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
       {"visible, mean", "clearance, worst [m]", "odometry error, p95 [m]", "distance ratio, mean",
        "visible, worst", "in image, mean", "travel ratio, mean", "certificate kept, mean",
        "reaction, worst [s]", "recovery, worst [s]", "non-finite setpoints", "plans in the air",
        "uncertified brakes", "accelerating brakes"})
    rows[0].push_back(title);
  Row all{"all", "", {}};
  for (const Json& flight : flights) all.flights.push_back(&flight);
  const std::vector<Row> places = RowsOf(flights), faults = FaultsOf(flights);
  for (const Row& row : places) rows.push_back(CellsOf(row));
  if (faults.size() < places.size())
    for (const Row& row : faults)
      if (!row.fault.empty()) rows.push_back(CellsOf(row));
  rows.push_back(CellsOf(all));
  return Markdown(rows) +
         "\nIn brackets: 95 % Wilson intervals of the share. Reaction counts from the age "
         "limit of the input that a fault\nruns out, recovery from the fault's end; - where there "
         "is "
         "none.\n\n" +
         FailedFlights(flights);
}

}  // namespace chase::campaign
