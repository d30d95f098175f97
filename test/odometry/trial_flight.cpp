#include "test/odometry/trial_flight.h"

#include <fmt/format.h>
#include <malloc.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <memory>

#include "chase/attitude_setpoint_t.hpp"
#include "common/bus/convert.h"
#include "common/bus/lockstep.h"
#include "services/odometry/odometry_node.h"
#include "services/simulator/simulator_node.h"
#include "test/odometry/courses.h"
#include "test/odometry/faults.h"

namespace chase::odometry::trial {

namespace {

constexpr int64_t kPowerOn = 1000000;  // us

/// Flies the course on the truth, so that every odometry is judged on the same flight.
class Pilot : public bus::Node {
 public:
  /// `loop` > 0: the course is turned round every so many seconds.
  Pilot(bus::Bus& bus, const Course& course, double loop)
      : bus_(bus), course_(course), loop_(loop), law_(control::ControlConfig{}) {
    bus_.Subscribe<truth_t>("TRUTH", [this](const truth_t& m) { OnTruth(m); });
  }

 private:
  void OnTruth(const truth_t& m) {
    const double t = m.mission_time;
    if (!course_.Flies() || t < Course::kTakeoff) return;
    const control::Estimate body{bus::ToVector(m.pos), bus::ToVector(m.vel),
                                 bus::ToQuaternion(m.orientation)};
    const control::Setpoint setpoint =
        law_.Track(body, ReferenceAt(t), ReferenceAt(t + 0.02), t > -5.0 ? 0.01 : 0.0);
    attitude_setpoint_t out{};
    out.utime = m.utime;
    bus::Set(out.orientation, setpoint.R_WB);
    bus::Set(out.body_rate, setpoint.w_WB_B);
    out.thrust = setpoint.thrust;
    out.motors = attitude_setpoint_t::MOTORS_ON;
    bus_.Publish("ATTITUDE_SETPOINT", out);
  }

  /// Endless flights go forth and back on the course.
  control::Reference ReferenceAt(double t) const {
    if (loop_ <= 0.0 || t < 0.0) return course_.At(t);
    const double phase = std::fmod(t, 2.0 * loop_);
    if (phase <= loop_) return course_.At(phase);
    control::Reference r = course_.At(2.0 * loop_ - phase);
    r.state.v = -r.state.v;
    r.state.j = -r.state.j;
    r.yaw_rate = -r.yaw_rate;
    return r;
  }

  bus::Bus& bus_;
  Course course_;
  double loop_;
  control::TrackingLaw law_;
};

simulator::SimulatorConfig SimulatorFor(const FlightOptions& options) {
  simulator::SimulatorConfig config;
  config.scenario = options.scenario;
  config.seed = options.seed;
  config.sensors = "raw";
  config.camera.rate = 0.0;
  for (double* sigma : {&config.lidar.noise, &config.lidar.dropout, &config.imu.accel_noise,
                        &config.imu.gyro_noise, &config.imu.accel_bias, &config.imu.gyro_bias,
                        &config.imu.accel_walk, &config.imu.gyro_walk})
    *sigma *= options.noise;
  return config;
}

void AddFlight(const world::Scenario& scenario, const FlightOptions& options, double loop,
               bus::Lockstep* lockstep) {
  lockstep->Add("simulator", 0, [&](bus::Bus& bus) {
    return std::make_unique<simulator::SimulatorNode>(bus, SimulatorFor(options));
  });
  lockstep->Add("pilot", 1000, [&](bus::Bus& bus) {
    return std::make_unique<Pilot>(bus, Course(options.course, scenario), loop);
  });
}

template <class T>
T Decoded(const bus::Bus::Bytes& bytes) {
  T m;
  m.decode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return m;
}

template <class T>
bus::Bus::Bytes Encoded(const T& m) {
  bus::Bus::Bytes bytes(static_cast<size_t>(m.getEncodedSize()));
  m.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

/// Passes a flight's messages through the fault into the log.
class Recorder {
 public:
  Recorder(const std::string& log, const Fault& fault) : writer_(log), fault_(fault) {}

  void See(int64_t now, const std::string& channel, const bus::Bus::Bytes& bytes) {
    if (channel == "TRUTH") fault_.See(Decoded<truth_t>(bytes));
    if (channel == "IMU") return Write(now, channel, Decoded<imu_t>(bytes));
    if (channel == "LIDAR_SCAN") return Write(now, channel, Decoded<lidar_scan_t>(bytes));
    if (channel == "TRUTH" || channel == "SCENARIO") writer_.Write(now, channel, bytes);
  }
  void Close() { writer_.Close(); }

 private:
  template <class T>
  void Write(int64_t now, const std::string& channel, T m) {
    if (fault_.Pass(now, &m)) writer_.Write(now, channel, Encoded(m));
  }

  bus::LogWriter writer_;
  Fault fault_;
};

int64_t UtimeOf(const world::Scenario& scenario, double mission_time) {
  return kPowerOn + std::llround(1e6 * (scenario.settle_s + mission_time));
}

double ResidentMegabytes() {
  std::ifstream statm("/proc/self/statm");
  double total = 0.0, resident = 0.0;
  statm >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) * 1e-6;
}

/// What the program holds of the heap, without what the allocator keeps for later.
double AllocatedMegabytes() {
  const struct mallinfo2 info = mallinfo2();
  return 1e-6 * static_cast<double>(info.uordblks + info.hblkhd);
}

}  // namespace

void Record(const FlightOptions& options, const std::string& log) {
  const world::Scenario scenario = world::LoadScenario(options.scenario);
  bus::Lockstep lockstep(kPowerOn);
  AddFlight(scenario, options, 0.0, &lockstep);
  Recorder recorder(log, Fault(options.fault, UtimeOf(scenario, options.fault_at)));
  lockstep.SetTap([&](int64_t now, const std::string& channel, const bus::Bus::Bytes& bytes) {
    recorder.See(now, channel, bytes);
  });
  lockstep.RunUntil(UtimeOf(scenario, options.until > 0.0 ? options.until : scenario.duration_s));
  recorder.Close();
}

void Endure(const FlightOptions& options, double minutes) {
  const world::Scenario scenario = world::LoadScenario(options.scenario);
  bus::Lockstep lockstep(kPowerOn);
  AddFlight(scenario, options, scenario.duration_s, &lockstep);
  OdometryConfig config;
  config.initial_position = scenario.chaser.start;
  config.filter.mount_sigma = 1e-4;  // the mounting is exact here
  config.initial_yaw_deg = scenario.chaser.yaw_deg;
  const OdometryNode* odometry = nullptr;
  lockstep.Add("odometry", 2000, [&](bus::Bus& bus) {
    auto node = std::make_unique<OdometryNode>(bus, config);
    odometry = node.get();
    return node;
  });
  for (double t = 0.0; t <= 60.0 * minutes; t += 60.0) {
    lockstep.RunUntil(UtimeOf(scenario, t));
    fmt::print("{:3.0f} min: process {:.1f} MB, in use {:.1f} MB, map {:.1f} MB\n", t / 60.0,
               ResidentMegabytes(), AllocatedMegabytes(),
               1e-6 * static_cast<double>(odometry->MapBytes()));
    std::fflush(stdout);
  }
}

}  // namespace chase::odometry::trial
