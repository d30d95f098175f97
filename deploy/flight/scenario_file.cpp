#include "deploy/flight/scenario_file.h"

#include <filesystem>
#include <stdexcept>

namespace chase::flight {

namespace fs = std::filesystem;

namespace {

/// share/chase beside the folder of this program, where the build links to and the package
/// installs.
fs::path Scenarios() {
  const fs::path program = fs::read_symlink("/proc/self/exe");
  return fs::weakly_canonical(program.parent_path().parent_path() / "share/chase/scenarios");
}

}  // namespace

std::string ScenarioFile(const std::string& scenario) {
  const fs::path folder = Scenarios();
  for (const fs::path& file : {fs::path(scenario), folder / (scenario + ".yaml"),
                               folder / "twelve" / (scenario + ".yaml")})
    if (fs::exists(file) && !fs::is_directory(file)) return fs::absolute(file).lexically_normal();
  throw std::runtime_error("no scenario '" + scenario + "'; use a file or a name from " +
                           folder.string());
}

}  // namespace chase::flight
