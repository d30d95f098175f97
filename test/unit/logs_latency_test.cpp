#include <gtest/gtest.h>

#include <map>

#include "chase/attitude_setpoint_t.hpp"
#include "chase/lidar_scan_t.hpp"
#include "chase/obstacles_t.hpp"
#include "chase/plan_t.hpp"
#include "chase/scan_registered_t.hpp"
#include "logs/src/sweep_latency.h"

namespace chase::logs {
namespace {

using Samples = std::vector<std::pair<int64_t, int64_t>>;

/// Messages that say what they were made from.
class Log {
 public:
  template <class T>
  void Put(int64_t when, const std::string& channel, int32_t seq,
           const std::map<std::string, int32_t>& inputs = {}) {
    T m{};
    m.utime = when;
    m.seq = seq;
    for (const auto& [name, input] : inputs) m.inputs.push_back({name, input});
    m.n_inputs = static_cast<int32_t>(m.inputs.size());
    LogEvent event{};
    event.channel = channel;
    event.bytes.resize(static_cast<size_t>(m.getEncodedSize()));
    m.encode(event.bytes.data(), 0, static_cast<int>(event.bytes.size()));
    latency.Add(when, event);
  }
  SweepLatency latency;
};

/// Sweep `seq` at `t` goes through odometry, mapping and planning.
void Pass(Log* log, int64_t t, int32_t seq) {
  log->Put<lidar_scan_t>(t, "v1/LIDAR_SCAN", seq);
  log->Put<scan_registered_t>(t + 10, "v1/SCAN_REGISTERED", seq + 5, {{"LIDAR_SCAN", seq}});
  log->Put<obstacles_t>(t + 30, "v1/OBSTACLES", seq + 7, {{"SCAN_REGISTERED", seq + 5}});
  log->Put<plan_t>(t + 40, "v1/PLAN", seq + 9, {{"POSE", 1}, {"OBSTACLES", seq + 7}});
}

TEST(SweepLatency, IsFollowedBackThroughTheInputs) {
  Log log;
  log.Put<attitude_setpoint_t>(900, "v1/ATTITUDE_SETPOINT", 0, {{"POSE", 1}});
  Pass(&log, 1000, 0);
  // Control knows the map already, but flies the plan before.
  log.Put<attitude_setpoint_t>(1041, "v1/ATTITUDE_SETPOINT", 1, {{"OBSTACLES", 7}, {"PLAN", 8}});
  EXPECT_EQ(log.latency.samples(), Samples());
  log.Put<attitude_setpoint_t>(1045, "v1/ATTITUDE_SETPOINT", 2, {{"OBSTACLES", 7}, {"PLAN", 9}});
  log.Put<attitude_setpoint_t>(1050, "v1/ATTITUDE_SETPOINT", 3, {{"OBSTACLES", 7}, {"PLAN", 9}});
  EXPECT_EQ(log.latency.samples(), (Samples{{1000, 45}})) << "the first alone";
}

TEST(SweepLatency, ASweepThatWasPassedOverIsAnsweredByTheNext) {
  Log log;
  log.Put<lidar_scan_t>(1000, "LIDAR_SCAN", 3);  // nobody registered it
  Pass(&log, 1100, 4);
  log.Put<attitude_setpoint_t>(1150, "v1/ATTITUDE_SETPOINT", 9, {{"PLAN", 13}});
  EXPECT_EQ(log.latency.samples(), (Samples{{1000, 150}, {1100, 50}}));
}

TEST(SweepLatency, AProcessThatBeginsAnewCountsFromZero) {
  Log log;
  for (const int64_t t : {1000, 2000}) {
    Pass(&log, t, 0);
    log.Put<attitude_setpoint_t>(t + 50, "v1/ATTITUDE_SETPOINT", 0, {{"PLAN", 9}});
  }
  EXPECT_EQ(log.latency.samples(), (Samples{{1000, 50}, {2000, 50}}));
}

}  // namespace
}  // namespace chase::logs
