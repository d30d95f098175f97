#include <fmt/format.h>
#include <gtest/gtest.h>
#include <octomap/octomap.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <set>
#include <vector>

#include "chase/obstacles_t.hpp"
#include "chase/scan_registered_t.hpp"

// The recorded drive through the programs as a user runs them: import, odometry, mapping.

namespace chase {
namespace {

constexpr char kRecording[] = "../shared/data/kitti/raw_2011_09_26_drive_0005_16ring.bin.xz";
constexpr double kReach = 15.0;   // returns from nearer than this count, m
constexpr double kWindow = 30.0;  // ... that end up within this of the last pose, m
// The scanner, 1.7 m above the road, is at z = 0: this leaves out the road.
constexpr double kLow = -1.2;
constexpr size_t kSweeps = 32;  // what returns in so many sweeps is a wall, a trunk, a parked car

void Execute(const std::string& command) { ASSERT_EQ(std::system(command.c_str()), 0) << command; }

template <class T, class F>
int ForEach(const std::string& file, const std::string& channel, const F& handle) {
  lcm::LogFile log(file, "r");
  int count = 0;
  while (const lcm::LogEvent* event = log.readNextEvent()) {
    T message;
    if (event->channel != channel) continue;
    EXPECT_GT(message.decode(event->data, 0, event->datalen), 0);
    handle(message);
    ++count;
  }
  return count;
}

using Cell = std::array<int, 3>;  // of the map's size

/// Cells in which sweep after sweep returned something.
std::vector<Cell> SolidCells(const std::string& registered, double resolution) {
  std::map<Cell, std::set<int>> sweeps;
  double end[2] = {0.0, 0.0};
  ForEach<scan_registered_t>(registered, "SCAN_REGISTERED", [&](const scan_registered_t& m) {
    std::copy(m.pos, m.pos + 2, end);
    for (size_t i = 0; i < m.x.size(); ++i)
      if (m.z[i] > kLow && std::hypot(m.x[i] - m.pos[0], m.y[i] - m.pos[1]) < kReach)
        sweeps[{static_cast<int>(std::floor(m.x[i] / resolution)),
                static_cast<int>(std::floor(m.y[i] / resolution)),
                static_cast<int>(std::floor(m.z[i] / resolution))}]
            .insert(m.seq);
  });
  std::vector<Cell> solid;
  for (const auto& [cell, seen] : sweeps)
    if (seen.size() >= kSweeps &&
        std::hypot(cell[0] * resolution - end[0], cell[1] * resolution - end[1]) < kWindow)
      solid.push_back(cell);
  return solid;
}

bool Occupied(const octomap::OcTree& tree, const Cell& cell) {
  const double r = tree.getResolution();
  const auto* node = tree.search((cell[0] + 0.5) * r, (cell[1] + 0.5) * r, (cell[2] + 0.5) * r);
  return node != nullptr && tree.isNodeOccupied(node);
}

TEST(KittiDrive, OdometryAndMappingRunThroughAndHousesStandInTheMap) {
  if (!std::filesystem::exists(kRecording)) GTEST_SKIP() << "skipped: real recordings not present";
  const std::string dir = testing::TempDir() + fmt::format("kitti_{}/", getpid()), bin = CHASE_BIN;
  std::filesystem::create_directories(dir);
  std::ofstream(dir + "m.yaml") << "statics: {radius: 15}\nsave_map: " << dir << "map.bt\n";
  Execute(bin + "/chase-log import kitti16 " + kRecording + " " + dir + "k.lcm > /dev/null");
  Execute(bin + "/chase-odometry --replay " + dir + "k.lcm --out " + dir + "o.lcm");
  Execute(bin + "/chase-mapping --config " + dir + "m.yaml --replay " + dir + "o.lcm --out " + dir +
          "m.lcm");
  long listed = 0;
  const int updates = ForEach<obstacles_t>(dir + "m.lcm", "OBSTACLES",
                                           [&](const obstacles_t& m) { listed += m.n_obstacles; });
  EXPECT_EQ(updates, 154);
  EXPECT_GT(listed, 154);

  octomap::OcTree tree(dir + "map.bt");
  const auto solid = SolidCells(dir + "o.lcm", tree.getResolution());
  const auto found = std::count_if(solid.begin(), solid.end(),
                                   [&](const Cell& cell) { return Occupied(tree, cell); });
  fmt::print("{} of {} solid cells are occupied in the map\n", found, solid.size());
  EXPECT_GT(solid.size(), 200u);
  EXPECT_GE(static_cast<double>(found), 0.8 * static_cast<double>(solid.size()));
  std::filesystem::remove_all(dir);
}

}  // namespace
}  // namespace chase
