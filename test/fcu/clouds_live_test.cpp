// Sweeps that went through data packets, a socket and chase-lidar against the same ones out of the
// simulation itself. Usage: clouds_live_test [SECONDS [gps]], stamped by arrival or by a sensor
// that a GPS disciplines; in a namespace (test/flight/in_namespace.sh).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <deque>

#include "chase/lidar_scan_t.hpp"
#include "chase/scenario_t.hpp"
#include "chase/status_t.hpp"
#include "common/bus/udp_bus.h"
#include "common/world/scenario.h"
#include "firing_order.h"
#include "process.h"
#include "services/simulator/simulator.h"

namespace chase::testing {
namespace {

constexpr char kScenario[] = CHASE_SOURCE_DIR "/deploy/scenarios/gym.yaml";

/// The simulation of a vehicle at rest: the same ticks give the same sweeps.
class Direct {
 public:
  Direct() : scenario_(world::LoadScenario(kScenario)), simulator_(scenario_, Config()) {}
  double settle_s() const { return scenario_.settle_s; }
  const simulator::Sweep& Next() {
    while (true) {
      auto output = simulator_.Advance(0.005 * static_cast<double>(ticks_++));
      if (output.sweep) return sweep_ = std::move(*output.sweep);
    }
  }

 private:
  static simulator::SimulatorConfig Config() {
    simulator::SimulatorConfig config;
    config.scenario = kScenario;
    config.lidar.packets = true;
    config.camera.rate = 0.0;
    return config;
  }
  world::Scenario scenario_;
  simulator::Simulator simulator_;
  simulator::Sweep sweep_;
  long ticks_ = 0;
};

struct Difference {
  long sweeps = 0, points = 0, unequal = 0;
  double worst = 0.0;  // m
  void Add(const simulator::Sweep& a, const lidar_scan_t& b) {
    ++sweeps;
    points += b.size;
    bool equal = a.x.size() == b.x.size();
    const std::vector<std::size_t> order = FiringOrder(a);
    for (std::size_t n = 0; n < order.size() && equal; ++n) {
      const std::size_t i = order[n];
      const float dx = a.x[i] - b.x[n], dy = a.y[i] - b.y[n], dz = a.z[i] - b.z[n];
      worst = std::max(worst, std::sqrt(static_cast<double>(dx * dx + dy * dy + dz * dz)));
      equal = a.ring[i] == b.ring[n] && a.intensity[i] == b.intensity[n];
    }
    if (!equal) ++unequal;
  }
};

/// s by which stamps are off the sweeps' starts, in the middle of all.
double Median(std::vector<double> off) {
  if (off.empty()) return NAN;
  const auto middle = off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2);
  std::nth_element(off.begin(), middle, off.end());
  return *middle;
}

int Compare(double seconds, bool gps) {
  bus::UdpBus bus(bus::kDefaultUrl, "");
  std::deque<lidar_scan_t> scans;
  status_t status{};
  scenario_t flown{};
  bus.Subscribe<lidar_scan_t>("LIDAR_SCAN", [&](const lidar_scan_t& m) { scans.push_back(m); });
  bus.Subscribe<status_t>("LIDAR_STATUS", [&](const status_t& m) { status = m; });
  bus.Subscribe<scenario_t>("SCENARIO", [&](const scenario_t& m) { flown = m; });
  Process lidar(CHASE_BIN "/chase-lidar",
                std::string("source: udp\nclock: ") + (gps ? "gps\n" : "arrival\n"));
  while (bus.counters().at("LIDAR_STATUS").received == 0) bus.Handle(100'000);  // it listens
  Process simulator(CHASE_BIN "/chase-simulator",
                    std::string("scenario: ") + kScenario +
                        "\nhardware: {lidar: udp, lidar_clock: " + (gps ? "gps" : "own") +
                        "}\ncamera: {rate: 0}\n");
  Direct direct;
  Difference difference;
  int next = 0;
  int64_t first = 0, last = 0, steady = 0;
  std::vector<double> off;  // s
  while (difference.sweeps < static_cast<long>(10.0 * seconds)) {
    const int64_t before = bus.Now();
    while (scans.empty() && bus.Now() - before < 20'000'000) bus.Handle(100'000);
    if (scans.empty()) break;
    const lidar_scan_t scan = std::move(scans.front());
    scans.pop_front();
    if (scan.seq != next++) break;  // of what was published, this process missed one
    if (first == 0) first = scan.utime;
    last = scan.utime;
    steady = std::max<int64_t>(steady, std::llabs(last - first - 100'000 * difference.sweeps));
    const simulator::Sweep& sweep = direct.Next();
    difference.Add(sweep, scan);
    off.push_back(1e-6 * static_cast<double>(scan.utime - flown.start_utime) + direct.settle_s() -
                  sweep.start);
  }
  std::printf(
      "%ld sweeps, %ld points; %ld unequal in count, rings or intensities; worst point "
      "%.6f m off; starts within %.2f ms of a steady 100 ms, stamped %.3f ms late; lidar: %s\n",
      difference.sweeps, difference.points, difference.unequal, difference.worst,
      1e-3 * static_cast<double>(steady), 1e3 * Median(off), status.detail.c_str());
  const bool lossless = status.detail.find(" 0 packets lost, 0 malformed") != std::string::npos;
  // The sensor says when it fired; by arrival the simulation's steps are in it as well.
  const bool timely = !gps || (std::abs(Median(off)) < 0.1e-3 &&
                               status.detail.find("by arrival") == std::string::npos);
  return difference.sweeps >= static_cast<long>(10.0 * seconds) && difference.unequal == 0 &&
                 difference.worst <= 1e-3 && lossless && timely
             ? 0
             : 1;
}

}  // namespace
}  // namespace chase::testing

int main(int argc, char** argv) {
  return chase::testing::Compare(argc > 1 ? std::atof(argv[1]) : 20.0,
                                 argc > 2 && std::string(argv[2]) == "gps");
}
