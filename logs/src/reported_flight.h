#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>

namespace chase::logs {

/// A flight as a report shows it.
struct ReportedFlight {
  std::string log;
  std::string metrics;          ///< metrics.json
  nlohmann::ordered_json page;  ///< what report.js draws: title, truth, judged (there is a sample
                                ///< of the mission), metrics, vehicle, data, moments, playback
  /// What the log lacks of the flight, a sentence; empty: nothing; none: nobody can tell.
  std::optional<std::string> shortfall;
};

struct ReportOptions {
  bool truth = true;         ///< by what really was, and what the vehicle said; else by that alone
  bool images = true;        ///< with key moments and playback, which take seconds
  std::string plots_folder;  ///< for pictures (PNG); empty: none
};

/// Throws std::runtime_error with one line when the log holds nothing to report.
ReportedFlight ReportFlight(const std::string& log, const ReportOptions& options);

/// Its metrics with null in place of criteria that nobody can judge, as CompareMetrics takes them.
std::string KnownMetrics(const ReportedFlight& flight);

/// Which flight it is, and of which software: log, scenario and seed, how much was flown, versions,
/// configurations; what its log lost. Lines for people.
std::string Heading(const ReportedFlight& flight);

/// The criteria, the losses, and that nobody knows whether the flight is whole, a line each, for
/// people.
std::string Summary(const ReportedFlight& flight);

}  // namespace chase::logs
