#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include "common/config/version.h"
#include "common/logs/log_reader.h"
#include "logs/src/compare.h"
#include "logs/src/output.h"
#include "logs/src/page_template.h"
#include "logs/src/report_page.h"
#include "logs/src/reported_flight.h"
#include "logs/src/vehicle_report.h"

namespace {

namespace fs = std::filesystem;
using namespace chase::logs;

constexpr double kTolerance = 0.01;  // share of a figure: less is not worth a flag

fs::path OutputFolder(const std::string& log, const std::string& out) {
  fs::path folder = out.empty() ? fs::path(log).parent_path() : fs::path(out);
  if (folder.empty()) folder = ".";
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw std::runtime_error(folder.string() + ": cannot be made: " + error.message());
  return folder;
}

/// Says where a log ends before the flight does; returns the exit code.
int Judge(const ReportedFlight& flight) {
  const std::string shortfall = flight.shortfall.value_or("");
  if (shortfall.empty()) return 0;
  std::fprintf(stderr, "chase-report: %s: %s\n", flight.log.c_str(), shortfall.c_str());
  return 2;
}

void SayByVehicle(const std::string& log, const std::string& lacks) {
  std::printf("%s holds no %s: reported is what the vehicle said of itself\n", log.c_str(),
              lacks.c_str());
}

/// Returns the exit code.
int Report(const std::string& log, const std::string& out) {
  const std::string lacks = LacksOfTruth(log);
  const fs::path folder = OutputFolder(log, out);
  const ReportedFlight flight = ReportFlight(log, {lacks.empty(), true, folder.string()});
  WriteFile((folder / "metrics.json").string(), flight.metrics);
  WritePage((folder / "report.html").string(), ShareFolder(), {flight});
  if (!lacks.empty()) SayByVehicle(log, lacks);
  std::printf("%s%s\n", Summary(flight).c_str(), (folder / "report.html").c_str());
  return Judge(flight);
}

/// The flights' own reports stay.
void RefuseOwnFolders(const std::vector<std::string>& logs, const std::string& out) {
  std::error_code none;
  for (const std::string& log : logs)
    if (fs::equivalent(fs::absolute(log).parent_path(), out, none))
      throw std::runtime_error("--out " + out + ": holds " + log +
                               " and its own report; name another folder for the comparison");
}

/// The figures of two flights side by side; with `out` as comparison.txt and report.html there too.
/// Without truth in both of them: what the vehicles said.
int Compare(const std::vector<std::string>& logs, const std::string& out) {
  RefuseOwnFolders(logs, out);
  bool truth = true;
  for (const std::string& log : logs) {
    const std::string lacks = LacksOfTruth(log);
    if (!lacks.empty()) SayByVehicle(log, lacks);
    truth = truth && lacks.empty();
  }
  std::vector<ReportedFlight> flights;
  int code = 0;
  for (const std::string& log : logs) {
    flights.push_back(ReportFlight(log, {truth, !out.empty(), ""}));
    code = std::max(code, Judge(flights.back()));
  }
  const auto figures =
      CompareMetrics(KnownMetrics(flights[0]), KnownMetrics(flights[1]), kTolerance);
  const std::string table =
      "A: " + Heading(flights[0]) + "B: " + Heading(flights[1]) + Format(figures);
  std::printf("%s", table.c_str());
  if (out.empty()) return code;
  const fs::path folder = OutputFolder(logs[1], out);
  WriteFile((folder / "comparison.txt").string(), table);
  WritePage((folder / "report.html").string(), ShareFolder(), flights, figures);
  std::printf("%s\n", (folder / "report.html").c_str());
  return code;
}

}  // namespace

/// Exit codes: 0 reported, whatever became of the flight, also where nobody can tell whether the
/// log holds all of it; 1 bad use; 2 reported as far as the log goes, which does not hold the whole
/// flight.
int main(int argc, char** argv) {
  CLI::App app{"Metrics, plots and one HTML page from a flight log."};
  app.name("chase-report");
  chase::config::AddVersion(&app);
  std::string log, other, out;
  app.add_option("LOG", log, "LCM log of a flight, or its folder")->required()->transform(LogOf);
  app.add_option("LOG2", other, "a second one: the two are compared, and what got worse is flagged")
      ->transform(LogOf);
  app.add_option("--out", out,
                 "folder for metrics.json, report.html and PNGs; default: the log's; of two "
                 "logs: for comparison.txt and report.html; default: neither is written");
  try {
    app.parse(argc, argv);
    return other.empty() ? Report(log, out) : Compare({log, other}, out);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);
    std::fprintf(stderr, "chase-report: %s; see chase-report --help\n", e.what());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "chase-report: %s\n", e.what());
  }
  return 1;
}
