#include "logs/src/reported_flight.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <set>
#include <stdexcept>

#include "logs/src/key_moments.h"
#include "logs/src/playback.h"
#include "logs/src/read_flight.h"
#include "logs/src/report_data.h"
#include "logs/src/report_plots.h"
#include "logs/src/vehicle_report.h"

namespace chase::logs {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kCannotTell = "whether this is the whole flight is not known";

/// `lacks`: phrases of what the log is or does, in place of holding the whole flight.
std::string Shortfall(std::vector<std::string> lacks, bool log_whole) {
  if (!log_whole) lacks.insert(lacks.begin(), "is cut off or damaged");
  return lacks.empty()
             ? ""
             : fmt::format("the log {}; the figures are of that part", fmt::join(lacks, " and "));
}

std::string Shortfall(const FlightRecord& record, const Metrics& m) {
  std::vector<std::string> lacks;
  if (!m.HoldsBeginning()) lacks.push_back(fmt::format("begins at {:.1f} s", m.begins_s));
  // A flight ends with its mission, or with the collision that it was ended by.
  if (!m.log_whole || !m.HoldsBeginning() || !(m.criteria.at("complete") || m.collision_s >= 0.0))
    lacks.push_back(
        fmt::format("ends at {:.1f} s of {:.1f} s", m.flown_s, record.scenario.duration_s));
  return Shortfall(lacks, m.log_whole);
}

std::optional<std::string> Shortfall(const VehicleReport& vehicle) {
  if (vehicle.whole && !vehicle.tells_states) return std::nullopt;
  std::vector<std::string> lacks;
  if (!vehicle.begins_in.empty()) lacks.push_back("begins in " + vehicle.begins_in);
  if (!vehicle.ends_in.empty())
    lacks.push_back(fmt::format("ends in {} at {:.1f} s", vehicle.ends_in,
                                vehicle.metrics["flown_s"].get<double>()));
  return Shortfall(lacks, vehicle.whole);
}

/// By the truth where the log holds it, whatever the report goes by.
std::optional<std::string> Shortfall(const std::string& log, const VehicleReport& vehicle) {
  if (!LacksOfTruth(log).empty()) return Shortfall(vehicle);
  const FlightRecord record = ReadFlight(log);
  return Shortfall(record, Compute(record, Score(record)));
}

/// What the truth knows of moments.
std::vector<Moment> MomentsOf(const std::vector<SampleScore>& scores, const Metrics& metrics) {
  std::vector<Moment> moments;
  if (metrics.collision_s >= 0.0) moments.push_back({metrics.collision_s, "collision", 0});
  const auto least = std::find_if(scores.begin(), scores.end(), [&](const SampleScore& s) {
    return !s.done && s.clearance == metrics.min_clearance_m;
  });
  if (least != scores.end()) moments.push_back({least->t, "smallest clearance", 1});
  return moments;
}

/// What both kinds of report show.
Json PageOf(const std::string& log, const std::string& title, const VehicleReport& vehicle,
            Json data, const std::vector<Moment>& moments, bool images) {
  Json page;
  page["title"] = title;
  page["log"] = log;
  page["vehicle"] = vehicle.metrics;
  if (images) {
    page["moments"] = ImagesAt(log, vehicle.origin, KeyMoments(data["spans"], moments));
    page["playback"] = PlaybackOf(log, vehicle.log_begin);
  }
  page["data"] = std::move(data);
  return page;
}

/// With what the log lacks of the flight in the page and in its metrics.
ReportedFlight Finished(const std::string& log, const std::optional<std::string>& shortfall,
                        Json page) {
  page["metrics"]["shortfall"] = shortfall ? Json(*shortfall) : Json();
  return {log, page["metrics"].dump(2) + "\n", page, shortfall};
}

/// The vehicle's series, and those of the truth in place of or beside them.
Json DataOf(const VehicleReport& vehicle, const ReportData& truth) {
  Json data = vehicle.series;
  const Json of_truth = ToJson(truth);
  for (const auto& [key, value] : of_truth.items()) {
    if (key != "spans")
      data[key] = value;
    else
      for (const Json& span : value) data["spans"].push_back(span);
  }
  return data;
}

ReportedFlight ByTruth(const std::string& log, const ReportOptions& options) {
  const FlightRecord record = ReadFlight(log);
  const auto scores = Score(record);
  const Metrics metrics = Compute(record, scores);
  const ReportData truth = PrepareReport(record, scores);
  if (!options.plots_folder.empty()) WritePlots(options.plots_folder, truth);
  const VehicleReport vehicle = ReportVehicle(log, record.origin_utime);
  Json page = PageOf(log, truth.title, vehicle, DataOf(vehicle, truth), MomentsOf(scores, metrics),
                     options.images);
  page["truth"] = true;
  page["judged"] = !scores.empty();
  page["metrics"] = Json::parse(MetricsJson(record, metrics));
  return Finished(log, Shortfall(record, metrics), std::move(page));
}

ReportedFlight ByVehicle(const std::string& log, const ReportOptions& options) {
  const VehicleReport vehicle = ReportVehicle(log);
  if (!vehicle.flew)
    throw std::runtime_error(log + ": holds neither TRUTH nor POSE nor PLAN: no flight to report");
  const ReportData said = PrepareReport(vehicle);
  if (!options.plots_folder.empty()) WritePlots(options.plots_folder, said);
  Json page = PageOf(log, said.title, vehicle, vehicle.series, {}, options.images);
  page["truth"] = false;
  page["metrics"] = vehicle.metrics;
  ReportedFlight flight = Finished(log, Shortfall(log, vehicle), std::move(page));
  flight.page["vehicle"] = flight.page["metrics"];
  return flight;
}

/// Most criteria are of samples of the mission.
bool Known(const ReportedFlight& flight, const std::string& criterion) {
  return flight.page["judged"].get<bool>() || criterion == "recorded" ||
         criterion == "finite_setpoints";
}

/// "planning 123, control 456", or each text once.
std::string Listed(const TextByProcess& texts, bool with_process) {
  std::set<std::string> items;
  for (const auto& [process, text] : texts)
    items.insert(with_process ? process + " " + text : text);
  return fmt::format("{}", fmt::join(items, ", "));
}

}  // namespace

ReportedFlight ReportFlight(const std::string& log, const ReportOptions& options) {
  return options.truth ? ByTruth(log, options) : ByVehicle(log, options);
}

std::string KnownMetrics(const ReportedFlight& flight) {
  Json metrics = flight.page["metrics"];
  if (metrics.contains("criteria"))
    for (const auto& criterion : metrics["criteria"].items())
      if (!Known(flight, criterion.key())) criterion.value() = nullptr;
  return metrics.dump();
}

std::string Heading(const ReportedFlight& flight) {
  const Json& metrics = flight.page["metrics"];
  const auto software = metrics["software"].get<std::map<std::string, TextByProcess>>();
  std::string text =
      fmt::format("{}\n  {}, {:.1f} s flown\n", flight.log, flight.page["title"].get<std::string>(),
                  metrics["flown_s"].get<double>());
  text += fmt::format("  {}\n", Listed(software.at("versions"), false));
  if (const auto& sums = software.at("configurations"); !sums.empty())
    text += fmt::format("  configurations: {}\n", Listed(sums, true));
  for (const Json& loss : metrics["losses"]) text += fmt::format("  {}\n", loss.get<std::string>());
  if (const std::string shortfall = flight.shortfall.value_or(kCannotTell); !shortfall.empty())
    text += fmt::format("  {}\n", shortfall);
  return text;
}

std::string Summary(const ReportedFlight& flight) {
  const Json& metrics = flight.page["metrics"];
  std::string text;
  if (metrics.contains("criteria"))
    for (const auto& [name, passed] : metrics["criteria"].items())
      text += fmt::format("{:<20} {}\n", name,
                          !Known(flight, name) ? "not known"
                          : passed.get<bool>() ? "passed"
                                               : "FAILED");
  for (const Json& loss : metrics["losses"]) text += loss.get<std::string>() + "\n";
  if (!flight.shortfall) text += fmt::format("{}\n", kCannotTell);
  return text;
}

}  // namespace chase::logs
