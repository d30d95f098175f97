#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include "common/config/version.h"
#include "logs/src/compare.h"
#include "logs/src/output.h"
#include "logs/src/page_template.h"
#include "logs/src/read_flight.h"
#include "logs/src/report_page.h"
#include "logs/src/report_plots.h"
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

void PrintSummary(const Metrics& m, const fs::path& folder) {
  for (const auto& [name, passed] : m.criteria)
    std::printf("%-20s %s\n", name.c_str(), passed ? "passed" : "FAILED");
  for (const std::string& loss : m.losses) std::printf("%s\n", loss.c_str());
  std::printf("%s\n", (folder / "report.html").c_str());
}

/// The flight's end is in the log: that of its mission, or the collision that it was ended by.
bool HoldsTheEnd(const Metrics& m) { return m.criteria.at("complete") || m.collision_s >= 0.0; }

/// Says where the log ends before the flight does; returns the exit code.
int Judge(const std::string& log, const FlightRecord& record, const Metrics& metrics) {
  if (metrics.log_whole && HoldsTheEnd(metrics)) return 0;
  std::fprintf(stderr,
               "chase-report: %s: the log %s at %.1f s of %.1f s; the figures are of that part\n",
               log.c_str(), metrics.log_whole ? "ends" : "is cut off or damaged and ends",
               metrics.flown_s, record.scenario.duration_s);
  return 2;
}

/// Of a log that holds no truth; returns the exit code.
int ReportOfVehicle(const std::string& log, const std::string& out) {
  const VehicleReport report = ReportVehicle(log);
  const fs::path folder = OutputFolder(log, out);
  const std::string metrics = report.metrics.dump(2) + "\n";
  WriteFile((folder / "metrics.json").string(), metrics);
  WriteFile((folder / "report.html").string(),
            FillPage(ShareFolder() + "/vehicle_report.html",
                     {{"/*DATA*/null", Embedded(report.series.dump())},
                      {"/*METRICS*/null", Embedded(metrics)},
                      {"/*PLOTLY*/", PlotlySource(ShareFolder() + "/plotly.min.js")}}));
  std::printf("%s holds no TRUTH: reported is what the vehicle said of itself\n%s\n", log.c_str(),
              (folder / "report.html").c_str());
  if (report.whole) return 0;
  std::fprintf(stderr,
               "chase-report: %s: the log is cut off or damaged; the figures are of its rest\n",
               log.c_str());
  return 2;
}

/// Returns the exit code.
int Report(const std::string& log, const std::string& out) {
  const FlightRecord record = ReadFlight(log);
  const auto scores = Score(record);
  const Metrics metrics = Compute(record, scores);
  const fs::path folder = OutputFolder(log, out);
  WriteMetricsJson((folder / "metrics.json").string(), record, metrics);
  const ReportData data = PrepareReport(record, scores);
  WritePlots(folder.string(), data);
  WritePage((folder / "report.html").string(), ShareFolder() + "/report.html",
            ShareFolder() + "/plotly.min.js", data, MetricsJson(record, metrics));
  PrintSummary(metrics, folder);
  return Judge(log, record, metrics);
}

/// The metrics of two flights side by side; with `out` as comparison.txt there too.
int Compare(const std::string& a, const std::string& b, const std::string& out) {
  std::string json[2];
  int code = 0;
  for (int i = 0; i < 2; ++i) {
    const std::string& log = i == 0 ? a : b;
    const FlightRecord record = ReadFlight(log);
    const Metrics metrics = Compute(record, Score(record));
    json[i] = MetricsJson(record, metrics);
    code = std::max(code, Judge(log, record, metrics));
  }
  const std::string table = Format(CompareMetrics(json[0], json[1], kTolerance));
  std::printf("A: %s\nB: %s\n%s", a.c_str(), b.c_str(), table.c_str());
  if (!out.empty()) WriteFile((OutputFolder(b, out) / "comparison.txt").string(), table);
  return code;
}

}  // namespace

/// Exit codes: 0 reported, whatever became of the flight; 1 bad use; 2 reported as far as the log
/// goes, which does not hold the whole flight.
int main(int argc, char** argv) {
  CLI::App app{"Metrics, plots and one HTML page from a flight log."};
  app.name("chase-report");
  chase::config::AddVersion(&app);
  std::string log, other, out;
  app.add_option("LOG", log, "LCM log of a flight")->required();
  app.add_option("LOG2", other,
                 "a second one: the two are compared, and what got worse is flagged");
  app.add_option("--out", out,
                 "folder for metrics.json, report.html and PNGs; default: the log's; of two "
                 "logs: for comparison.txt");
  try {
    app.parse(argc, argv);
    if (!other.empty()) return Compare(log, other, out);
    return HoldsTruth(log) ? Report(log, out) : ReportOfVehicle(log, out);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);
    std::fprintf(stderr, "chase-report: %s; see chase-report --help\n", e.what());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "chase-report: %s\n", e.what());
  }
  return 1;
}
