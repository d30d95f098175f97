#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "common/bus/channels.h"
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

/// The launcher's part of a fault in a live flight; null: the simulator has it. A fault for good
/// has null for its length.
Json LaunchersPart(const chase::world::FaultSpec& fault, const chase::world::FaultKind& kind) {
  using Effect = chase::world::FaultKind::Effect;
  Json part = {{"name", fault.name}, {"at_s", fault.at}, {"for_s", fault.duration}};
  if (kind.effect == Effect::kKill || kind.effect == Effect::kFreeze ||
      kind.effect == Effect::kDiskFull)
    return part;
  if (kind.effect == Effect::kDelay || kind.effect == Effect::kLoss) {
    part["bus"] = true;  // each process does it to itself
    return part;
  }
  if (kind.effect == Effect::kLoad) {
    part["times"] = kind.amount;
    return part;
  }
  if (kind.effect != Effect::kFlood) return {};
  part["rate_hz"] = kind.amount;
  for (const auto& row : chase::bus::ChannelTable()) part["channels"].push_back(row.channel);
  return part;
}

Json Told(const chase::world::Scenario& scenario, int64_t seed) {
  Json told = {{"duration_s", scenario.duration_s}, {"settle_s", scenario.settle_s}};
  told["commands"] = told["faults"] = Json::array();
  for (const auto& command : scenario.commands) told["commands"].push_back(CommandOf(command));
  int number = 0;
  for (const auto& spec : scenario.faults) {
    const auto fault = chase::world::Settled(spec, scenario.duration_s, seed, number++);
    const Json part = LaunchersPart(fault, chase::world::KindOf(fault));
    if (!part.is_null()) told["faults"].push_back(part);
  }
  return told;
}

}  // namespace

/// Checks a scenario file without the services, so that it is the first program that is built.
int main(int argc, char** argv) {
  CLI::App app(
      "Checks a scenario file; prints its length, its commands and the faults that a live flight's "
      "launcher brings about as one line of JSON.",
      "chase-scenario");
  chase::config::AddVersion(&app);
  std::string file;
  int64_t seed = 1;
  app.add_option("scenario", file, "name in deploy/scenarios, or a file")->required();
  app.add_option("--seed", seed, "that times of faults are drawn from (default 1)")
      ->check(CLI::Range(int64_t{0}, int64_t{2147483647}));
  try {
    app.parse(argc, argv);
    const chase::world::Scenario scenario =
        chase::world::LoadScenario(chase::flight::ScenarioFile(file));
    chase::world::TargetMotion(scenario);  // reads its path_file
    fmt::print("{}\n", Told(scenario, seed).dump());
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
