#include <CLI/CLI.hpp>

#include "common/bus/run_service.h"
#include "common/logs/log_reader.h"
#include "services/viewer/play.h"
#include "services/viewer/token_file.h"
#include "services/viewer/viewer_node.h"

int main(int argc, char** argv) {
  using chase::viewer::ViewerConfig;
  ViewerConfig config;
  int port = -1;  // of the flag
  std::string log, token_file;

  chase::bus::ServiceSpec spec;
  spec.name = "viewer";
  spec.description = "Shows a flight, live or from a log, on a web page and to Foxglove.";
  spec.add_flags = [&](CLI::App& app) {
    app.add_option("--port", port, "of the page (default: the configuration's, 8080)")
        ->check(CLI::Range(0, 65535));
    auto* token = app.add_option(
        "--token-file", token_file,
        "its first line is what commands must carry (default: no commands are taken)");
    auto* play =
        app.add_option("--play", log, "LCM log, or folder of a flight, to play instead of the bus")
            ->transform(chase::logs::LogOf);
    for (const char* live : {"--lcm-url", "--channel-prefix", "--key-file", "--replay"})
      play->excludes(app.get_option(live));
    play->excludes(token);
  };
  spec.dump_config = [&] { return chase::config::Dump(config); };
  spec.load_config = [&](const std::string& file) { chase::config::Load(file, &config); };
  spec.run = [&] {
    if (port >= 0) config.port = port;
    if (!token_file.empty()) config.token = chase::viewer::TokenIn(token_file);
    if (!log.empty()) chase::viewer::PlayLog(log, config, chase::bus::StopRequested);
    return !log.empty();
  };
  spec.make_node = [&](chase::bus::Bus& bus) {
    return std::make_unique<chase::viewer::ViewerNode>(bus, config);
  };
  return chase::bus::RunService(spec, argc, argv);
}
