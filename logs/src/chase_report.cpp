#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include "logs/src/page_template.h"
#include "logs/src/read_flight.h"
#include "logs/src/report_page.h"
#include "logs/src/report_plots.h"

namespace {

namespace fs = std::filesystem;
using namespace chase::logs;

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
  std::printf("%s\n", (folder / "report.html").c_str());
}

void Report(const std::string& log, const std::string& out) {
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
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Metrics, plots and one HTML page from a flight log."};
  app.name("chase-report");
  app.set_version_flag("--version", CHASE_VERSION);
  std::string log, out;
  app.add_option("LOG", log, "LCM log of a simulated flight")->required();
  app.add_option("--out", out, "folder for metrics.json, report.html and PNGs; default: the log's");
  try {
    app.parse(argc, argv);
    Report(log, out);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);
    std::fprintf(stderr, "chase-report: %s; see chase-report --help\n", e.what());
    return 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "chase-report: %s\n", e.what());
    return 1;
  }
  return 0;
}
