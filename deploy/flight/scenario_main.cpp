#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "common/config/version.h"
#include "common/world/scenario.h"
#include "deploy/flight/scenario_file.h"

/// Checks a scenario file without the services, so that it is the first program that is built.
int main(int argc, char** argv) {
  CLI::App app("Checks a scenario file; prints its length and commands as one line of JSON.",
               "chase-scenario");
  chase::config::AddVersion(&app);
  std::string file;
  app.add_option("scenario", file, "name in deploy/scenarios, or a file")->required();
  try {
    app.parse(argc, argv);
    const chase::world::Scenario scenario =
        chase::world::LoadScenario(chase::flight::ScenarioFile(file));
    chase::world::TargetMotion(scenario);  // reads its path_file
    std::string commands;
    for (const chase::world::CommandSpec& c : scenario.commands)
      commands += fmt::format("{}{{\"command\": \"{}\", \"at_s\": {}}}",
                              commands.empty() ? "" : ", ", c.command, c.at_s);
    fmt::print("{{\"duration_s\": {:.1f}, \"settle_s\": {:.1f}, \"commands\": [{}]}}\n",
               scenario.duration_s, scenario.settle_s, commands);
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
