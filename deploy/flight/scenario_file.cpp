#include "deploy/flight/scenario_file.h"

#include <filesystem>
#include <stdexcept>

namespace chase::flight {

std::string ScenarioFile(const std::string& scenario) {
  namespace fs = std::filesystem;
  const fs::path folder = CHASE_SCENARIOS;
  for (const fs::path& file : {fs::path(scenario), folder / (scenario + ".yaml"),
                               folder / "twelve" / (scenario + ".yaml")})
    if (fs::exists(file) && !fs::is_directory(file)) return fs::absolute(file).lexically_normal();
  throw std::runtime_error("no scenario '" + scenario +
                           "'; use a name from deploy/scenarios or a file");
}

}  // namespace chase::flight
