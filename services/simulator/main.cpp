#include <CLI/CLI.hpp>

#include "common/bus/run_service.h"
#include "services/simulator/simulator_node.h"

namespace chase::simulator {
namespace {

constexpr char kPurpose[] = "Simulates the world, the quadrotor and its sensors.";

void AddFlags(CLI::App& app, HardwareConfig* hardware, bool* all) {
  app.add_option("--fcu", hardware->fcu, "lcm, or mavlink: PX4 over UDP (default: lcm)")
      ->check(CLI::IsMember({"lcm", "mavlink"}));
  app.add_flag("--hardware", *all, "MAVLink, VLP-16 packets and an MJPEG stream in LCM's place");
}

}  // namespace
}  // namespace chase::simulator

int main(int argc, char** argv) {
  using namespace chase::simulator;
  SimulatorConfig config;
  HardwareConfig flags;
  bool all = false;
  chase::bus::ServiceSpec spec;
  spec.name = "simulator";
  spec.description = kPurpose;
  spec.dump_config = [&] { return chase::config::Dump(config); };
  spec.load_config = [&](const std::string& file) { chase::config::Load(file, &config); };
  spec.make_node = [&](chase::bus::Bus& bus) {
    if (all || flags.mavlink()) config.hardware.fcu = "mavlink";
    if (all) config.hardware.lidar = "udp", config.hardware.camera = "mjpeg";
    return std::make_unique<SimulatorNode>(bus, config);
  };
  spec.add_flags = [&](CLI::App& app) { AddFlags(app, &flags, &all); };
  return chase::bus::RunService(spec, argc, argv);
}
