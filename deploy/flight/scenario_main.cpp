#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "common/config/version.h"
#include "common/world/fault.h"
#include "common/world/scenario.h"
#include "deploy/flight/scenario_file.h"

namespace {

using Json = nlohmann::ordered_json;

/// An operator's command as chase-command takes it, so that a live flight gives what one in
/// lockstep does: there kill is forced, and select has its place.
Json CommandOf(const chase::world::CommandSpec& command) {
  Json words = Json::array();
  if (command.command == "kill") words.push_back("--force");
  for (const double px : command.at_px) words.push_back(fmt::format("{}", px));
  return {{"command", command.command}, {"at_s", command.at_s}, {"arguments", words}};
}

Json Told(const chase::world::Scenario& scenario) {
  Json told = {{"duration_s", scenario.duration_s}, {"settle_s", scenario.settle_s}};
  told["commands"] = told["left_out_live"] = Json::array();
  for (const auto& command : scenario.commands) told["commands"].push_back(CommandOf(command));
  for (const auto& fault : scenario.faults)  // only the simulator strikes in a live flight
    if (chase::world::KindOf(fault).victim != "simulator")
      told["left_out_live"].push_back(fault.name);
  return told;
}

}  // namespace

/// Checks a scenario file without the services, so that it is the first program that is built.
int main(int argc, char** argv) {
  CLI::App app(
      "Checks a scenario file; prints its length, its commands and the faults that a live flight "
      "leaves out as one line of JSON.",
      "chase-scenario");
  chase::config::AddVersion(&app);
  std::string file;
  app.add_option("scenario", file, "name in deploy/scenarios, or a file")->required();
  try {
    app.parse(argc, argv);
    const chase::world::Scenario scenario =
        chase::world::LoadScenario(chase::flight::ScenarioFile(file));
    chase::world::TargetMotion(scenario);  // reads its path_file
    fmt::print("{}\n", Told(scenario).dump());
    return 0;
  } catch (const CLI::Success& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    fmt::print(stderr, "chase-scenario: {}; see chase-scenario --help\n", e.what());
  } catch (const std::exception& e) {
    fmt::print(stderr, "chase-scenario: {}\n", e.what());
  }
  return 1;
}
