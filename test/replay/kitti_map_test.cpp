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
// The scanner is 1.7 m above the road, which falls by half a metre on the way: this leaves it out.
constexpr double kLow = -1.2;
constexpr size_t kSweeps = 32;  // what returns in so many sweeps is a wall, a trunk, a parked car

constexpr double kOtherTime = 1.5, kLatest = 4.0;  // s before or after, when a mover is elsewhere
constexpr double kSame = 0.25;      // share of its returns that its place has while it is elsewhere
constexpr double kFarWay = 20.0;    // m, that a vehicle in traffic goes while it is followed
constexpr double kFewWrong = 0.06;  // share of the listed movers that are none

/// Vehicles that stand beside the road during the whole drive.
struct Parked {
  double x, y, yaw;  ///< of the centre, m and rad, in the frame of the first sweep
};
/// From the labels of KITTI's tracking benchmark, whose training sequence 0000 is this drive, taken
/// to that frame by odometry's poses. What drives there and stops is not among them.
constexpr Parked kParked[] = {{41.3, 13.9, -0.20}, {59.7, 6.4, -0.86}, {64.1, 6.4, -0.19},
                              {69.1, 13.7, -0.24}, {70.9, 5.1, -0.20}, {74.4, 12.5, -0.20},
                              {76.1, 4.3, -0.16},  {79.2, 11.6, -0.15}};
constexpr double kHalfLength = 2.8, kHalfWidth = 1.2;  // m, of the largest, and a margin

bool IsOn(const Parked& place, double x, double y) {
  const double dx = x - place.x, dy = y - place.y;
  const double along = std::cos(place.yaw) * dx + std::sin(place.yaw) * dy;
  const double across = std::cos(place.yaw) * dy - std::sin(place.yaw) * dx;
  return std::abs(along) < kHalfLength && std::abs(across) < kHalfWidth;
}
constexpr double kWallsFound = 0.95;  // share of solid cells that the map must hold

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

struct Returns {
  double t;  // s
  std::vector<std::array<float, 2>> points;
};

std::vector<Returns> AboveTheRoad(const std::string& registered) {
  std::vector<Returns> sweeps;
  ForEach<scan_registered_t>(registered, "SCAN_REGISTERED", [&](const scan_registered_t& m) {
    sweeps.push_back({1e-6 * static_cast<double>(m.utime), {}});
    for (size_t i = 0; i < m.x.size(); ++i)
      if (m.z[i] > m.pos[2] + kLow) sweeps.back().points.push_back({m.x[i], m.y[i]});
  });
  return sweeps;
}

long Within(const obstacle_t& o, const Returns& sweep) {
  const auto& c = o.center.coefficients;
  return std::count_if(sweep.points.begin(), sweep.points.end(), [&](const auto& p) {
    const double x = p[0] - c[0], y = p[1] - c[1];
    return o.shape[0] * x * x + 2.0 * o.shape[1] * x * y + o.shape[3] * y * y < 1.0;
  });
}

/// Nothing is there, or what is there was there before and will be there later as well.
bool IsNoMover(const obstacle_t& o, double t, const std::vector<Returns>& sweeps) {
  long now = 0;
  for (const auto& sweep : sweeps)
    if (std::abs(sweep.t - t) < 0.05) now = Within(o, sweep);
  int others = 0, same = 0;
  for (const auto& sweep : sweeps) {
    const double away = std::abs(sweep.t - t);
    if (away < kOtherTime || away > kLatest) continue;
    ++others;
    same += static_cast<double>(Within(o, sweep)) > kSame * static_cast<double>(now);
  }
  return now == 0 || 2 * same > others;
}

/// Sweeps in which something returns from there.
long SweepsThatSee(const Parked& place, const std::vector<Returns>& sweeps) {
  constexpr long kFewest = 5;
  return std::count_if(sweeps.begin(), sweeps.end(), [&](const Returns& sweep) {
    return std::count_if(sweep.points.begin(), sweep.points.end(),
                         [&](const auto& p) { return IsOn(place, p[0], p[1]); }) >= kFewest;
  });
}

/// The recording, registered by odometry once for all tests.
class KittiDrive : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    if (!std::filesystem::exists(kRecording)) return;
    dir_ = testing::TempDir() + fmt::format("kitti_{}/", getpid());
    std::filesystem::create_directories(dir_);
    Execute(bin_ + "/chase-log import kitti16 " + kRecording + " " + dir_ + "k.lcm > /dev/null");
    Execute(bin_ + "/chase-odometry --replay " + dir_ + "k.lcm --out " + dir_ + "o.lcm");
  }
  static void TearDownTestSuite() {
    if (!dir_.empty()) std::filesystem::remove_all(dir_);
  }
  void SetUp() override {
    if (dir_.empty()) GTEST_SKIP() << "skipped: real recordings not present";
  }
  static void Map(const std::string& config) {
    std::ofstream(dir_ + "m.yaml") << config;
    Execute(bin_ + "/chase-mapping --config " + dir_ + "m.yaml --replay " + dir_ + "o.lcm --out " +
            dir_ + "m.lcm");
  }
  static inline std::string dir_, bin_ = CHASE_BIN;
};

TEST_F(KittiDrive, VehiclesInTrafficAreFollowedAndWhatStandsIsNot) {
  Map("grid: {min_range: 2.5}\n");  // the car that carries the scanner is in view as well
  const auto sweeps = AboveTheRoad(dir_ + "o.lcm");
  std::map<int, std::pair<std::array<double, 2>, double>> ways;  // first place, farthest from it
  int listed = 0, wrong = 0, parked = 0;
  ForEach<obstacles_t>(dir_ + "m.lcm", "OBSTACLES", [&](const obstacles_t& m) {
    for (const auto& o : m.obstacles) {
      if (o.kind != +obstacle_t::MOVING) continue;
      const auto& c = o.center.coefficients;
      auto& way = ways.insert({o.id, {{c[0], c[1]}, 0.0}}).first->second;
      way.second = std::max(way.second, std::hypot(c[0] - way.first[0], c[1] - way.first[1]));
      ++listed;
      wrong += IsNoMover(o, 1e-6 * static_cast<double>(m.utime), sweeps);
      parked += std::any_of(std::begin(kParked), std::end(kParked),
                            [&](const Parked& place) { return IsOn(place, c[0], c[1]); });
    }
  });
  const auto far = std::count_if(ways.begin(), ways.end(),
                                 [](const auto& way) { return way.second.second > kFarWay; });
  fmt::print("{} tracks, {} over more than {} m; of {} listed movers {} are none, {} parked cars\n",
             ways.size(), far, kFarWay, listed, wrong, parked);
  EXPECT_GE(far, 2);
  EXPECT_EQ(parked, 0);
  for (const Parked& place : kParked)
    EXPECT_GE(SweepsThatSee(place, sweeps), 5) << place.x << " " << place.y;
  EXPECT_LE(wrong, kFewWrong * listed);
}

TEST_F(KittiDrive, OdometryAndMappingRunThroughAndHousesStandInTheMap) {
  Map("statics: {radius: 15}\nsave_map: " + dir_ + "map.bt\n");
  long listed = 0;
  const int updates = ForEach<obstacles_t>(dir_ + "m.lcm", "OBSTACLES",
                                           [&](const obstacles_t& m) { listed += m.n_obstacles; });
  EXPECT_EQ(updates, 154);
  EXPECT_GT(listed, 154);

  octomap::OcTree tree(dir_ + "map.bt");
  const auto solid = SolidCells(dir_ + "o.lcm", tree.getResolution());
  const auto found = std::count_if(solid.begin(), solid.end(),
                                   [&](const Cell& cell) { return Occupied(tree, cell); });
  fmt::print("{} of {} solid cells are occupied in the map\n", found, solid.size());
  EXPECT_GT(solid.size(), 200u);
  EXPECT_GE(static_cast<double>(found), kWallsFound * static_cast<double>(solid.size()));
}

}  // namespace
}  // namespace chase
