#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "chase/attitude_setpoint_t.hpp"
#include "chase/flight_state_t.hpp"
#include "chase/lidar_scan_t.hpp"
#include "chase/scan_registered_t.hpp"
#include "chase/tracking_t.hpp"
#include "logs/src/metrics.h"
#include "logs/src/read_flight.h"
#include "logs/src/report_data.h"
#include "logs/src/report_page.h"
#include "logs/src/round_numbers.h"
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
  event.name = "lidar-dead";  // does not end
  event.utime = 6000000;
  event.phase = event_t::BEGINS;
  out.Write(4, "FAULT", event);
  truth.utime = 10000000;
  truth.mission_time = 7.0;
  out.Write(5, "TRUTH", truth);
  out.Close();
  const FlightRecord record = ReadFlight(log);
  ASSERT_EQ(record.faults.size(), 3u);
  EXPECT_EQ(record.faults[0].name, "kill-control");
  EXPECT_EQ(record.faults[0].t, 1.0);
  EXPECT_EQ(record.faults[0].end, 1.5);
  EXPECT_EQ(record.faults[1].t, 2.0);
  EXPECT_EQ(record.faults[1].end, 2.5);
  EXPECT_FALSE(record.faults[2].end);
  const auto spans = ToJson(PrepareReport(record, {}))["spans"];
  ASSERT_EQ(spans.size(), 3u);
  EXPECT_EQ(spans[0]["label"], "kill-control");
  EXPECT_EQ(spans[0]["from"], 1.0);
  EXPECT_EQ(spans[0]["to"], 1.5);
  EXPECT_EQ(spans[2]["to"], 7.0) << "to the log's end";
}

/// Truth every 10 ms from 1 s of the flight's clock on; the log's stamps run twice as fast.
void WriteTruth(OutputLog* out, int64_t utime) {
  truth_t truth{};
  truth.utime = utime;
  truth.mission_time = 1e-6 * static_cast<double>(utime - 1000000);
  truth.orientation[0] = 1.0;
  out->Write(2 * utime, "TRUTH", truth);
}

TEST(ReadFlight, WhatIsHeardIsTimedByTheTruthsClock) {
  const std::string log = Fresh("heard") + "/flight.lcm";
  OutputLog out(log);
  scenario_t scenario{};
  scenario.yaml = kYaml;
  out.Write(1, "SCENARIO", scenario);
  for (int64_t t = 1000000; t <= 2000000; t += 10000) WriteTruth(&out, t);
  obstacles_t obstacles{};
  obstacles.utime = 1900000;
  out.Write(2 * 2000000 + 5000, "OBSTACLES", obstacles);
  flight_state_t state{};
  state.utime = 2000000;
  state.state = flight_state_t::HOLD;
  state.reason = "asked for";
  out.Write(2 * 2000000 + 6000, "FLIGHT_STATE", state);
  tracking_t tracking{};
  tracking.utime = 2000000;
  tracking.following = tracking_t::STOP;
  tracking.plan_seq = 7;
  out.Write(2 * 2000000 + 7000, "TRACKING", tracking);
  out.Close();
  const FlightRecord record = ReadFlight(log);
  const auto& heard = record.heard.at("OBSTACLES");
  ASSERT_EQ(heard.size(), 1u);
  EXPECT_NEAR(heard[0].t, 1.005, 1e-9);
  EXPECT_NEAR(heard[0].stamp, 0.9, 1e-9);
  ASSERT_EQ(record.tracking.size(), 1u);
  EXPECT_NEAR(record.tracking[0].t, 1.007, 1e-9);
  EXPECT_EQ(record.tracking[0].following, int{tracking_t::STOP});
  EXPECT_EQ(record.tracking[0].plan_seq, 7);
  ASSERT_EQ(record.states.size(), 1u);
  EXPECT_EQ(record.states[0].reason, "asked for");
  const auto page = ReportFlight(log, {}).page;
  const auto& spans = page["data"]["spans"];
  const bool told = std::any_of(spans.begin(), spans.end(), [](const auto& s) {
    return s["lane"] == "flight" && s["label"] == "HOLD" && s.value("reason", "") == "asked for";
  });
  EXPECT_TRUE(told) << spans.dump();
  EXPECT_EQ(page["metrics"]["flight_states"][0]["reason"], "asked for");
  EXPECT_EQ(page["vehicle"]["flight_states"][0]["reason"], "asked for");
}

TEST(ReadFlight, SetpointsThatAreNoNumbersAreCountedThoughNobodyTakesThem) {
  const std::string log = Fresh("setpoints") + "/flight.lcm";
  OutputLog out(log);
  scenario_t scenario{};
  scenario.yaml = kYaml;
  out.Write(1, "SCENARIO", scenario);
  WriteTruth(&out, 1000000);
  attitude_setpoint_t setpoint{};
  setpoint.orientation[0] = 1.0;
  out.Write(2100000, "ATTITUDE_SETPOINT", setpoint);
  attitude_setpoint_t bad = setpoint;
  bad.thrust = std::nan("");
  out.Write(2200000, "ATTITUDE_SETPOINT", bad);
  bad = setpoint;
  bad.orientation[3] = std::nan("");
  out.Write(2300000, "ATTITUDE_SETPOINT", bad);
  bad = setpoint;
  bad.body_rate[2] = INFINITY;
  out.Write(2400000, "ATTITUDE_SETPOINT", bad);
  out.Close();
  EXPECT_EQ(ReadFlight(log).nonfinite_setpoints, 3);
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

/// A share folder as beside bin/, with a stand-in for Plotly and no viewer.
std::string Share(const std::string& folder) {
  fs::create_directories(folder + "/share");
  for (const auto& part : fs::directory_iterator("logs/page"))
    fs::copy(part.path(), folder + "/share", fs::copy_options::overwrite_existing);
  WriteFile(folder + "/share/plotly.min.js", "/* the library */");
  return folder + "/share";
}

TEST(Report, PageAndPicturesStandWithoutAnythingElse) {
  const std::string folder = Fresh("page"), log = folder + "/flight.lcm";
  testing::WriteSyntheticLog(log, kYaml);
  const ReportedFlight flight = ReportFlight(log, {true, true, folder});
  for (const char* name :
       {"top_view", "distance", "visibility", "clearance", "pixels", "stages", "cpu"})
    EXPECT_GT(fs::file_size(fs::path(folder) / (std::string(name) + ".png")), 3000u) << name;
  WritePage(folder + "/report.html", Share(folder), {flight});
  const std::string page = testing::ReadText(folder + "/report.html");
  EXPECT_NE(page.find("/* the library */"), std::string::npos);
  EXPECT_NE(page.find("\"safe_ratio\""), std::string::npos);
  EXPECT_EQ(page.find("src=\"http"), std::string::npos);
  for (const char* mark : {"/*DATA*/", "/*STYLE*/", "/*CHARTS*/", "/*PLAYBACK*/", "/*REPORT*/"})
    EXPECT_EQ(page.find(mark), std::string::npos) << mark;
}

/// Names without their ending.
std::set<std::string> PicturesIn(const std::string& folder) {
  std::set<std::string> names;
  for (const auto& file : fs::directory_iterator(folder))
    if (file.path().extension() == ".png" && fs::file_size(file) > 3000)
      names.insert(file.path().stem().string());
  return names;
}

TEST(Report, PicturesOfWhatTheVehicleSaidStandWithoutTruth) {
  const std::string folder = Fresh("vehicle_pictures"), log = folder + "/flight.lcm";
  testing::WriteSyntheticLog(log, kYaml);
  ReportFlight(log, {false, false, folder});
  EXPECT_EQ(PicturesIn(folder),
            (std::set<std::string>{"top_view", "timeline", "distance", "certificate", "uncertainty",
                                   "latency", "stages", "cpu"}));
}

TEST(Report, SeriesOfTruthAndVehicleShareTheMissionsTime) {
  const std::string log = Fresh("times") + "/flight.lcm";
  testing::SyntheticFlight flight;
  flight.start_utime = 50'000'000;
  testing::WriteSyntheticLog(log, kYaml, flight);
  const auto page = ReportFlight(log, {}).page;
  const auto& data = page["data"];
  EXPECT_NEAR(data["distance"]["t"].front(), 0.0, 0.1);  // scored over the mission
  EXPECT_NEAR(data["speed"]["t"].front(), -3.0, 0.1);    // heard from the start on
  EXPECT_NEAR(data["speed"]["t"].back(), 12.0, 0.2);
  EXPECT_NEAR(page["playback"]["begin"], -3.0, 0.01);
  EXPECT_NEAR(page["playback"]["duration"], 15.0, 0.05);
  EXPECT_TRUE(data["latency"].contains("POSE"));
  // The estimate is off by 0.1 m along x: it is drawn beside the truth, not in its place.
  EXPECT_NE(data["estimated"], data["chaser"]);
}

TEST(Report, WithoutTruthItTellsWhatTheVehicleSaid) {
  const std::string log = Fresh("vehicle") + "/flight.lcm";
  testing::WriteSyntheticLog(log, kYaml);
  const auto page = ReportFlight(log, {false, true, ""}).page;
  for (const char* key : {"distance", "certified", "speed", "pose_sigma", "target_sigma"})
    EXPECT_FALSE(page["data"][key]["t"].empty()) << key;
  EXPECT_FALSE(page["data"].contains("clearance"));  // only truth knows it
  EXPECT_FALSE(page["metrics"].contains("recorded_utc")) << "logical time has no date";
  EXPECT_EQ(page["vehicle"], page["metrics"]);
  EXPECT_GT(page["playback"]["frames"].size(), 100u);
}

TEST(Report, TheMapHasWhatTheVehicleBelievedWithTruthOrWithout) {
  const std::string log = Fresh("believed") + "/flight.lcm";
  testing::WriteSyntheticLog(log, kYaml);
  const auto with = ReportFlight(log, {true, false, ""}).page["data"];
  const auto without = ReportFlight(log, {false, false, ""}).page["data"];
  for (const char* key : {"perceived", "plans", "predictions"}) {
    ASSERT_FALSE(with.at(key).empty()) << key;
    ASSERT_EQ(without.at(key).size(), with.at(key).size()) << key;
    const std::vector<double> x = with.at(key).back()["x"], same = without.at(key).back()["x"];
    ASSERT_EQ(same.size(), x.size()) << key;
    for (size_t i = 0; i < x.size(); ++i) EXPECT_NEAR(same[i], x[i], 1.1e-3) << key;  // rounded
  }
}

/// Puts messages that say what they were made from into a live log.
class LiveLog {
 public:
  explicit LiveLog(const std::string& file) : out_(file) {}
  template <class T>
  void Put(int64_t t, const std::string& channel, T m,  // t: ms
           const std::map<std::string, int32_t>& inputs = {}) {
    m.utime = kBegin + 1000 * t;
    m.vehicle = "v1/";
    for (const auto& [name, seq] : inputs) m.inputs.push_back({name, seq});
    m.n_inputs = static_cast<int32_t>(m.inputs.size());
    out_.Write(m.utime, "v1/" + channel, m);
  }
  /// A sweep whose setpoint comes 45 ms later.
  void PutSweep(int64_t t, int32_t seq) {
    lidar_scan_t scan{};
    scan.seq = seq;
    Put(t, "LIDAR_SCAN", scan);
    if (seq == 0) return;  // nobody registers the first
    scan_registered_t registered{};
    registered.seq = seq;
    Put(t + 10, "SCAN_REGISTERED", registered, {{"LIDAR_SCAN", seq}});
    obstacles_t obstacles{};
    obstacles.seq = seq;
    Put(t + 30, "OBSTACLES", obstacles, {{"SCAN_REGISTERED", seq}});
    plan_t plan{};
    plan.seq = seq;
    Put(t + 40, "PLAN", plan, {{"OBSTACLES", seq}});
    Put(t + 45, "ATTITUDE_SETPOINT", attitude_setpoint_t{}, {{"PLAN", seq}});
  }
  void Close() { out_.Close(); }

 private:
  static constexpr int64_t kBegin = 1'700'000'000'000'000;  // 2023-11-14 22:13:20 UTC, us
  OutputLog out_;
};

TEST(Report, WithoutTruthItTellsDateVehicleAndTheLatencyOfSweeps) {
  const std::string log = Fresh("live") + "/flight.lcm";
  LiveLog live(log);
  pose_t pose{};
  pose.orientation[0] = 1.0;
  live.Put(0, "POSE", pose);
  live.PutSweep(10, 0);  // while it stands
  tracking_t tracking{};
  tracking.following = tracking_t::PLAN;
  live.Put(5000, "TRACKING", tracking);
  for (int32_t seq = 1; seq <= 10; ++seq) live.PutSweep(5000 + 100 * seq, seq);
  status_t status{};
  status.name = "planning";
  live.Put(6900, "PLANNING_STATUS", status);
  live.Close();
  const auto metrics = ReportFlight(log, {false, false, ""}).page["metrics"];
  EXPECT_EQ(metrics.value("recorded_utc", ""), "2023-11-14 22:13:20");
  EXPECT_EQ(metrics.value("vehicles", std::vector<std::string>()), std::vector<std::string>{"v1/"});
  const auto latency = metrics.value("sweep_to_setpoint_ms", nlohmann::ordered_json());
  EXPECT_EQ(latency.value("p50", -1.0), 45.0) << latency;
  EXPECT_EQ(latency.value("max", -1.0), 45.0) << "a sweep that came before the plans counts";
}

/// Poses at x, every 5 ms from `from` ms on for a second; seq goes on.
void PutPoses(LiveLog* live, int64_t from, double x, int32_t epoch, int32_t seq) {
  pose_t pose{};
  pose.orientation[0] = 1.0;
  pose.sender = "odometry";
  pose.epoch = epoch;
  pose.pos[0] = x;
  for (int k = 0; k < 200; ++k) {
    pose.seq = seq + k;
    live->Put(from + 5 * k, "POSE", pose);
  }
}

TEST(Report, WithoutTruthAPathAndDistancesBreakWhereTheFrameChanges) {
  const std::string log = Fresh("frames") + "/flight.lcm";
  LiveLog live(log);
  const auto put_targets = [&](int64_t from, int32_t epoch) {
    target_t target{};
    target.state = target_t::TRACKING;
    target.epoch = epoch;
    target.mean[0] = 3.0;
    for (int k = 1; k < 20; ++k) live.Put(from + 50 * k, "TARGET", target);
  };
  PutPoses(&live, 0, 1.0, 7, 0);
  put_targets(1000, 7);  // the last POSE is fresh for the first two of these
  PutPoses(&live, 2000, 50.0, 9, 200);
  put_targets(2000, 7);  // of the frame before
  put_targets(3000, 9);
  live.Close();
  const auto page = ReportFlight(log, {false, false, ""}).page;
  const auto breaks = [](const auto& values) {
    return std::count_if(values.begin(), values.end(),
                         [](const auto& v) { return std::isnan(v.template get<double>()); });
  };
  EXPECT_EQ(breaks(page["data"]["chaser"]["x"]), 1) << page["data"]["chaser"];
  EXPECT_EQ(breaks(page["data"]["target"]["x"]), 1) << page["data"]["target"];
  const auto& distance = page["data"]["distance"]["value"];
  EXPECT_EQ(distance.dump(), "[2.0,null,47.0]");
  EXPECT_EQ(breaks(page["data"]["speed"]["value"]), 1) << page["data"]["speed"];
  EXPECT_EQ(page["metrics"]["frame_changes"], 1);
  EXPECT_TRUE(page["metrics"]["replans"].is_null());
  EXPECT_TRUE(page["metrics"]["fallbacks"].is_null());
}

TEST(Report, PicturesBreakWhereTheFrameChangesAndNeedNoTarget) {
  const std::string folder = Fresh("few_pictures"), log = folder + "/flight.lcm";
  LiveLog live(log);
  PutPoses(&live, 0, 1.0, 7, 0);
  PutPoses(&live, 2000, 50.0, 9, 200);
  live.Close();
  ReportFlight(log, {false, false, folder});
  EXPECT_EQ(PicturesIn(folder),
            (std::set<std::string>{"top_view", "timeline", "uncertainty", "latency"}));
}

TEST(Report, ThePathAsEstimatedBreaksWhereTheFrameChanges) {
  FlightRecord record;
  record.scenario.duration_s = 10.0;
  for (int k = 0; k < 100; ++k) record.poses.push_back({0.1 * k, {0, 0, 1}, 0.0, k < 50 ? 7 : 9});
  const auto x = ToJson(PrepareReport(record, {}))["estimated"]["x"];
  EXPECT_TRUE(std::isnan(x[50].get<double>())) << x;
  EXPECT_EQ(x.size(), 101u);
}

TEST(Report, AClockThatWasSetDoesNotCount) {
  for (const int64_t by : {3'600'000, -3'600'000}) {
    const std::string log = Fresh("clock") + "/flight.lcm";
    LiveLog live(log);
    PutPoses(&live, 0, 1.0, 7, 0);
    PutPoses(&live, 1000 + by, 1.0, 7, 200);
    live.Close();
    const auto page = ReportFlight(log, {false, false, ""}).page;
    EXPECT_NEAR(page["metrics"]["flown_s"], 2.0, 0.02);
    EXPECT_NEAR(page["metrics"]["latency_ms"]["POSE"]["max"], 0.0, 20.0);
    EXPECT_NEAR(page["data"]["speed"]["t"].back(), 1.9, 0.1);
    EXPECT_EQ(page["metrics"]["losses"].size(), 1u) << page["metrics"]["losses"];
  }
}

TEST(Report, WithTruthAClockThatWasSetDoesNotCountEither) {
  const auto page = [](int64_t by) {
    const std::string log = Fresh("clock_truth") + "/flight.lcm";
    testing::SyntheticFlight flight;
    flight.start_utime = 7'200'000'000;
    flight.clock_step = by;
    testing::WriteSyntheticLog(log, kYaml, flight);
    return ReportFlight(log, {true, true, ""}).page;
  };
  const auto calm = page(0);
  for (const int64_t by : std::vector<int64_t>{3'600'000'000, -3'600'000'000, 10'000'000}) {
    const auto set = page(by);
    ASSERT_EQ(set["metrics"]["losses"].size(), 1u);
    EXPECT_NE(set["metrics"]["losses"][0].dump().find("clock stepped by"), std::string::npos);
    for (const char* key : {"flown_s", "odometry_ate_m", "target_rmse_m", "prediction_error_m",
                            "replans", "safe_ratio", "real_time_factor"})
      EXPECT_NEAR(set["metrics"][key], calm["metrics"][key], 0.01) << key << " " << by;
    for (const char* key : {"distance", "clearance", "speed"}) {
      const std::vector<double> t = set["data"][key]["t"], same = calm["data"][key]["t"];
      ASSERT_LT(t.size() - same.size() + 2, 5u) << key << " " << by;
      EXPECT_NEAR(t.back(), same.back(), 0.1) << key << " " << by;
    }
    ASSERT_EQ(set["data"]["spans"].size(), calm["data"]["spans"].size());
    for (const char* key : {"begin", "duration"})
      EXPECT_NEAR(set["playback"][key], calm["playback"][key], 0.02) << key << " " << by;
  }
}

TEST(Report, WithoutTruthFiguresOfWhatIsNotThereAreNull) {
  const std::string log = Fresh("lacking") + "/flight.lcm";
  LiveLog live(log);
  plan_t plan{};
  plan.position.duration = plan.target.duration = 1.0;
  plan.position.n_coefficients = plan.target.n_coefficients = 3;
  plan.position.coefficients = plan.target.coefficients = {0.0, 0.0, 1.0};
  plan.n_yaw = 1;
  plan.yaw = {0.0};
  for (const int8_t verdict : {plan_t::WAIT, plan_t::WAIT, plan_t::CHASE, plan_t::WAIT}) {
    plan.verdict = verdict;
    live.Put(40 * plan.seq, "PLAN", plan);
    ++plan.seq;
  }
  live.Close();
  const auto metrics = ReportFlight(log, {false, false, ""}).page["metrics"];
  for (const char* key : {"path_m", "speed_max_mps", "pose_sigma_max_m", "frame_changes"})
    EXPECT_TRUE(metrics.at(key).is_null()) << key;
  EXPECT_EQ(metrics["replans"], 4);
  EXPECT_EQ(metrics["fallbacks"], 1) << "waits before the chase are none";
}

TEST(Report, AMissingLibraryIsNamedWithTheCure) {
  const std::string folder = Fresh("missing"), share = Share(folder);
  fs::remove(share + "/plotly.min.js");
  try {
    WritePage(folder + "/r.html", share, {});
    FAIL() << "there is no library";
  } catch (const std::runtime_error& e) {
    EXPECT_NE(std::string(e.what()).find("npm ci"), std::string::npos);
  }
  EXPECT_FALSE(fs::exists(folder + "/r.html"));
}

TEST(Report, TextInTheDataCannotEndTheScript) {
  const std::string folder = Fresh("escape");
  ReportedFlight flight;
  flight.page["title"] = "</script><b>\xff";
  WritePage(folder + "/r.html", Share(folder), {flight});
  EXPECT_EQ(testing::ReadText(folder + "/r.html").find("</script><b>"), std::string::npos);
}

TEST(Compare, FlightsWithoutTruthByWhatTheySaid) {
  const std::string before = R"({"target_known_ratio": 0.9, "latency_ms": {"POSE": {"p99": 5.0}}})";
  const std::string after = R"({"target_known_ratio": 0.5, "latency_ms": {"POSE": {"p99": 5.01}}})";
  std::map<std::string, bool> worse;
  for (const auto& f : CompareMetrics(before, after, 0.01))
    if (!f.a.empty()) worse[f.key] = f.worse;
  EXPECT_EQ(worse, (std::map<std::string, bool>{{"target_known_ratio", true},
                                                {"latency_ms.POSE.p99", false}}));
}

TEST(Compare, CriteriaThatNobodyCanJudgeAreNotKnown) {
  const std::string log = Fresh("climb") + "/flight.lcm";
  OutputLog out(log);
  scenario_t scenario{};
  scenario.yaml = kYaml;
  out.Write(1, "SCENARIO", scenario);
  WriteTruth(&out, 500000);  // before the mission
  out.Close();
  const std::string metrics = KnownMetrics(ReportFlight(log, {true, false, ""}));
  std::map<std::string, std::string> told;
  for (const auto& f : CompareMetrics(metrics, metrics, 0.01)) told[f.key] = f.a + "/" + f.b;
  EXPECT_EQ(told.at("criteria.complete"), "not known/not known");
  EXPECT_EQ(told.at("criteria.recorded"), "passed/passed");
}

TEST(Compare, FiguresHaveTheDigitsOfTheReportAndLessThanHalfOfOneIsNotWorse) {
  const auto compared = [](double a, double b) {
    const auto json = [](double ate) {
      return R"({"visible_ratio": 0.98768, "odometry_ate_m": )" + std::to_string(ate) + "}";
    };
    std::map<std::string, ComparedFigure> figures;
    for (const auto& f : CompareMetrics(json(a), json(b), 0.01)) figures[f.key] = f;
    EXPECT_EQ(figures.at("visible_ratio").a, "98.77 %");
    return figures.at("odometry_ate_m");
  };
  EXPECT_EQ(compared(0.0002022, 0.01).a, "0.000 m");
  EXPECT_FALSE(compared(0.0100, 0.0104).worse) << "4 %, but 0.4 mm";
  EXPECT_TRUE(compared(0.0100, 0.0106).worse);
  EXPECT_FALSE(compared(0.1000, 0.1009).worse) << "0.9 mm, but 0.9 %";
}

TEST(RoundNumbers, ToSixDigitsInListsAndObjectsToo) {
  auto json = nlohmann::ordered_json::parse(
      R"({"a": 1.5499999999999998, "b": [1234567, 0.12345678], "c": {"d": 1e-9}, "e": "0.12345678"})");
  RoundNumbers(&json);
  EXPECT_EQ(json.dump(), R"({"a":1.55,"b":[1234567,0.123457],"c":{"d":1e-09},"e":"0.12345678"})");
}

}  // namespace
}  // namespace chase::logs
