#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "common/config/version.h"
#include "test/odometry/judge.h"
#include "test/odometry/trial_flight.h"

namespace chase::odometry::trial {
namespace {

struct Arguments {
  FlightOptions flight;
  JudgeOptions judge;
  std::string log;
  double minutes = 30.0;
};

void AddFlightOptions(CLI::App* app, Arguments* a) {
  app->add_option("scenario", a->flight.scenario, "scenario file")->required();
  app->add_option("--course", a->flight.course, "follow, aggressive, hover or rest");
  app->add_option("--seed", a->flight.seed, "of all noise");
  app->add_option("--noise", a->flight.noise, "factor on the sensors' noise; 0: exact sensors");
}

int Run(int argc, char** argv) {
  CLI::App app("Flights of the simulated sensors for odometry, and their figures.",
               "odometry_trial");
  chase::config::AddVersion(&app);
  app.require_subcommand(1);
  Arguments a;
  CLI::App* record = app.add_subcommand("record", "fly a course, keep what the sensors say");
  AddFlightOptions(record, &a);
  record->add_option("log", a.log, "LCM log to write")->required();
  record->add_option("--until", a.flight.until, "mission time, s");
  record->add_option("--fault", a.flight.fault,
                     "no_sweeps, no_imu, corridor, dropped, nan or stamps");
  record->add_option("--at", a.flight.fault_at, "mission time of the fault, s");
  CLI::App* judge = app.add_subcommand("judge", "figures of POSE against TRUTH");
  judge->add_option("truth", a.judge.truth, "log with TRUTH")->required();
  judge->add_option("pose", a.judge.pose, "log with POSE")->required();
  judge->add_option("--from", a.judge.from, "mission time, s");
  judge->add_option("--until", a.judge.until, "mission time, s");
  judge->add_option("--fault-at", a.judge.fault_at, "mission time, s");
  judge->add_option("--fault-length", a.judge.fault_length, "s");
  judge->add_option("--series", a.judge.series, "CSV of the errors over time to write");
  CLI::App* endure = app.add_subcommand("endure", "memory over a long flight with odometry");
  AddFlightOptions(endure, &a);
  endure->add_option("--minutes", a.minutes, "simulated");
  try {
    app.parse(argc, argv);
  } catch (const CLI::Success& e) {
    return app.exit(e);
  }
  if (*record) Record(a.flight, a.log);
  if (*judge) fmt::print("{}\n", Judge(a.judge));
  if (*endure) Endure(a.flight, a.minutes);
  return 0;
}

}  // namespace
}  // namespace chase::odometry::trial

int main(int argc, char** argv) {
  try {
    return chase::odometry::trial::Run(argc, argv);
  } catch (const CLI::ParseError& e) {
    fmt::print(stderr, "odometry_trial: {}; see odometry_trial --help\n", e.what());
  } catch (const std::exception& e) {
    fmt::print(stderr, "odometry_trial: {}\n", e.what());
  }
  return 1;
}
