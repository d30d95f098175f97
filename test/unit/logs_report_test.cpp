#include <gtest/gtest.h>

#include <filesystem>
#include <nlohmann/json.hpp>

#include "logs/src/read_flight.h"
#include "logs/src/report_page.h"
#include "logs/src/report_plots.h"
#include "logs_synthetic_flight.h"

namespace chase::logs {
namespace {

namespace fs = std::filesystem;

constexpr const char* kYaml = R"(
name: small hall
duration_s: 12
settle_s: 3
world:
  walls:
    - {from: [-5, -3], to: [15, -3], height: 4}
  cylinders:
    - {center: [4, 1.5], radius: 0.28}
target:
  waypoints: [[0, 0], [10, 0]]
  speed: 1.0
chaser: {start: [-3, 0, 0], desired_distance: 2.5}
)";

std::string Fresh(const std::string& name) {
  const fs::path folder = fs::path(::testing::TempDir()) / ("chase_report_" + name);
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder.string();
}

TEST(ReadFlight, FiguresOfASyntheticFlightAreTheOnesItWasMadeWith) {
  const std::string log = Fresh("read") + "/flight.lcm";
  testing::SyntheticFlight flight;
  flight.wall_factor = 1.25;
  testing::WriteSyntheticLog(log, kYaml, flight);
  const FlightRecord record = ReadFlight(log);
  EXPECT_EQ(record.scenario.name, "small hall");
  EXPECT_EQ(record.seed, 7);
  EXPECT_NEAR(record.truth.front().t, -3.0, 1e-6);
  EXPECT_NEAR(record.truth.back().t, 12.0, 1e-6);
  const Metrics m = Compute(record);
  EXPECT_NEAR(*m.odometry_ate_m, 0.1, 1e-3);
  EXPECT_NEAR(*m.target_rmse_m, 0.05, 1e-3);
  EXPECT_NEAR(*m.real_time_factor, 0.8, 1e-3);
  EXPECT_EQ(m.replans, 301);
  EXPECT_EQ(m.fallbacks, 4);
  EXPECT_EQ(m.plan_ms->p99, 36.0);
  EXPECT_EQ(m.cpu_s.at("odometry"), 21.0);
  EXPECT_EQ(*m.safe_ratio, 1.0);
  EXPECT_EQ(*m.in_image_ratio, 1.0);
}

TEST(ReadFlight, FaultsAreThoseThatBegan) {
  const std::string log = Fresh("faults") + "/flight.lcm";
  OutputLog out(log);
  scenario_t scenario{};
  scenario.yaml = kYaml;
  out.Write(1, "SCENARIO", scenario);
  truth_t truth{};
  truth.utime = 2000000;
  truth.mission_time = -1.0;
  truth.orientation[0] = 1.0;
  out.Write(1, "TRUTH", truth);
  event_t event{};
  for (const auto& [utime, name] : {std::pair(5000000, "lidar-gap"), {4000000, "kill-control"}}) {
    event.name = name;
    event.utime = utime;
    event.phase = event_t::BEGINS;
    out.Write(2, "FAULT", event);
    event.utime += 500000;
    event.phase = event_t::ENDS;
    out.Write(3, "FAULT", event);
  }
  out.Close();
  const FlightRecord record = ReadFlight(log);
  ASSERT_EQ(record.faults.size(), 2u);
  EXPECT_EQ(record.faults[0].name, "kill-control");
  EXPECT_EQ(record.faults[0].t, 1.0);
  EXPECT_EQ(record.faults[1].t, 2.0);
}

TEST(ReadFlight, LogsWithoutTruthAreRefusedInOneLine) {
  const std::string log = Fresh("none") + "/x.lcm";
  OutputLog out(log);
  out.Write(1, "POSE", pose_t{});
  out.Close();
  try {
    ReadFlight(log);
    FAIL() << "no truth in it";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("no TRUTH"), std::string::npos);
  }
}

TEST(Report, PageAndPicturesStandWithoutAnythingElse) {
  const std::string folder = Fresh("page");
  testing::WriteSyntheticLog(folder + "/flight.lcm", kYaml);
  const FlightRecord record = ReadFlight(folder + "/flight.lcm");
  const auto scores = Score(record);
  const ReportData data = PrepareReport(record, scores);
  WritePlots(folder, data);
  for (const char* name :
       {"top_view", "distance", "visibility", "clearance", "pixels", "stages", "cpu"})
    EXPECT_GT(fs::file_size(fs::path(folder) / (std::string(name) + ".png")), 3000u) << name;
  const std::string plotly = folder + "/plotly.js";
  WriteFile(plotly, "/* the library */");
  WritePage(folder + "/report.html", "logs/src/report.html", plotly, data,
            MetricsJson(record, Compute(record, scores)));
  const std::string page = testing::ReadText(folder + "/report.html");
  EXPECT_NE(page.find("/* the library */"), std::string::npos);
  EXPECT_NE(page.find("\"safe_ratio\""), std::string::npos);
  EXPECT_EQ(page.find("src=\"http"), std::string::npos);
  EXPECT_EQ(page.find("/*DATA*/null"), std::string::npos);
}

TEST(Report, AMissingLibraryIsNamedWithTheCure) {
  const std::string folder = Fresh("missing");
  try {
    WritePage(folder + "/r.html", "logs/src/report.html", folder + "/none.js", {}, "{}");
    FAIL() << "there is no library";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("npm ci"), std::string::npos);
  }
  EXPECT_FALSE(fs::exists(folder + "/r.html"));
}

TEST(Report, TextInTheDataCannotEndTheScript) {
  const std::string folder = Fresh("escape");
  WriteFile(folder + "/p.js", "");
  ReportData data;
  data.title = "</script><b>";
  WritePage(folder + "/r.html", "logs/src/report.html", folder + "/p.js", data, "{}");
  EXPECT_EQ(testing::ReadText(folder + "/r.html").find("</script><b>"), std::string::npos);
}

}  // namespace
}  // namespace chase::logs
