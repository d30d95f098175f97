#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <string>
#include <vector>

#include "common/bus/run_service.h"
#include "services/perception/perception_node.h"
#include "services/perception/tools/learn.h"

namespace {

using chase::perception::PerceptionConfig, chase::perception::PerceptionNode;

/// The command beside the service, for --help: with it LearnColour takes the whole command line.
void AddFlags(CLI::App& app) {
  static std::vector<std::string> pictures;
  app.add_option("--learn-colour", pictures,
                 "IMAGE MASK [IMAGE MASK ...]: learn the target's colour and shape from marked "
                 "pictures, into --out YAML, and end");
}

}  // namespace

int main(int argc, char** argv) {
  const bool learns = std::any_of(argv, argv + argc, [](const char* argument) {
    return std::string(argument).rfind("--learn-colour", 0) == 0;
  });
  if (learns) return chase::perception::LearnColour(argc, argv);
  PerceptionConfig config;
  chase::bus::ServiceSpec spec;
  spec.name = "perception";
  spec.description = "Finds the target: images, sweeps and poses in, its Gaussian out.";
  spec.dump_config = [&] { return chase::config::Dump(config); };
  spec.load_config = [&](const std::string& file) { chase::config::Load(file, &config); };
  spec.make_node = [&](chase::bus::Bus& bus) {
    return std::make_unique<PerceptionNode>(bus, config);
  };
  spec.add_flags = AddFlags;
  return chase::bus::RunService(spec, argc, argv);
}
