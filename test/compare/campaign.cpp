#include "test/compare/campaign.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <stdexcept>

#include "deploy/campaign/text_file.h"
#include "test/baselines/registry.h"
#include "test/compare/flight_file.h"

namespace chase::compare {
namespace {

namespace fs = std::filesystem;

std::string NameOf(const std::string& scenario) { return fs::path(ScenarioFile(scenario)).stem(); }

/// Of the program, the scenario and the target's path: equal prints, equal flights.
std::string FingerprintOf(const std::string& scenario) {
  static const std::string program =
      campaign::Fingerprint({campaign::ReadText(campaign::ThisProgram())});
  return campaign::Fingerprint({program, campaign::ScenarioText(ScenarioFile(scenario))});
}

}  // namespace

std::vector<Flight> FlightsOf(const Arguments& arguments) {
  std::vector<std::string> scenarios = arguments.scenarios, planners;
  if (scenarios.empty())
    for (int i = 1; i <= 12; ++i) scenarios.push_back("S" + std::to_string(i));
  for (const std::string& given : arguments.planners)
    for (const std::string& name : baselines::Expand(given)) planners.push_back(name);
  if (arguments.planners.empty())
    for (const auto& entry : baselines::Planners())
      if (entry.by_default) planners.push_back(entry.name);
  std::vector<Flight> flights;
  std::map<std::string, std::string> files;
  for (const std::string& scenario : scenarios) {
    if (!fs::is_regular_file(ScenarioFile(scenario)))
      throw std::runtime_error(
          "no scenario '" + scenario +
          "'; use S1 to S12 or the path of a scenario file whose obstacles are "
          "upright ellipsoids");
    LoadMission(scenario);  // what cannot be flown is said before the first flight
    const std::string name = NameOf(scenario);
    if (const auto [at, fresh] = files.emplace(name, scenario); !fresh)
      throw std::runtime_error(scenario + ": has the same name as " + at->second +
                               "; results would overwrite each other");
    for (std::string planner : planners) {
      Flight flight{scenario, planner, ""};
      std::replace(planner.begin(), planner.end(), ':', '-');
      flight.file =
          (fs::path(arguments.out) / "flights" / (name + "_" + planner + ".json")).string();
      if (std::none_of(flights.begin(), flights.end(),
                       [&](const Flight& other) { return other.file == flight.file; }))
        flights.push_back(flight);
    }
  }
  return flights;
}

std::vector<campaign::Job> Jobs(const std::vector<Flight>& flights) {
  std::vector<campaign::Job> jobs;
  for (const Flight& f : flights)
    jobs.push_back({NameOf(f.scenario) + " " + f.planner,
                    {campaign::ThisProgram(), "--fly", f.scenario, "--planners", f.planner,
                     "--result", f.file},
                    f.file,
                    FingerprintOf(f.scenario)});
  return jobs;
}

void Fly(const Flight& flight) {
  const Mission mission = LoadMission(flight.scenario);
  const auto planner =
      baselines::MakePlanner(flight.planner, {mission.planning.planner, mission.name, 0});
  const Rollout rollout = Fly(mission, planner.get());
  auto json = FlightJson(mission, flight.planner, rollout, Judge(mission, rollout));
  json["fingerprint"] = FingerprintOf(flight.scenario);
  if (const fs::path folder = fs::path(flight.file).parent_path(); !folder.empty())
    fs::create_directories(folder);
  campaign::WriteText(flight.file, json.dump() + "\n");
}

}  // namespace chase::compare
