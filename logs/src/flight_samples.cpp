#include "logs/src/flight_samples.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <stdexcept>

#include "chase/attitude_setpoint_t.hpp"
#include "chase/imu_t.hpp"
#include "chase/pose_t.hpp"
#include "chase/tracking_t.hpp"
#include "common/bus/convert.h"
#include "common/math/rotation.h"
#include "logs/src/good_message.h"

namespace chase::logs {
namespace {

constexpr int64_t kGap = 50'000;   // us between poses, or samples of the IMU
constexpr int64_t kOld = 100'000;  // us of a setpoint: as old as a pose may be (world::kMostAge)
// us after a sample odometry knows its biases best: what it still learns of them during the climb
// after take-off would be drag, and later they have walked on.
constexpr int64_t kLearned = 20'000'000;
constexpr double kAirborne = 0.3;  // m/s: no body stands at that; as control has it

/// The messages of one channel; a vehicle's prefix may stand before its name.
template <class T>
class Channel {
 public:
  explicit Channel(std::string name) : name_(std::move(name)) {}

  void Take(const LogEvent& e) {
    T m;
    if (IsOn(e, name_)) ++count_;
    if (!Good(e, name_, &m)) return;
    if (found_.empty()) found_ = e.channel;
    if (found_ != e.channel) several_ = true;
    messages_.push_back(std::move(m));
  }
  /// In the order of stamps.
  const std::vector<T>& Sorted(const std::string& log) {
    if (messages_.empty() && count_ > 0)
      throw std::runtime_error(log + ": all " + std::to_string(count_) + " messages of " + name_ +
                               " are malformed; chase-log info says of which type they are");
    if (messages_.empty())
      throw std::runtime_error(log + ": holds no " + name_ +
                               "; identify needs IMU, POSE, ATTITUDE_SETPOINT and TRACKING");
    if (several_) RefuseSeveralVehicles(log, name_);
    std::stable_sort(messages_.begin(), messages_.end(),
                     [](const T& a, const T& b) { return a.utime < b.utime; });
    return messages_;
  }

 private:
  std::string name_, found_;
  bool several_ = false;
  long count_ = 0;
  std::vector<T> messages_;
};

/// The last that is not after `utime`; null: none.
template <class T>
const T* LastOf(const std::vector<T>& messages, int64_t utime) {
  const auto after = std::upper_bound(messages.begin(), messages.end(), utime,
                                      [](int64_t t, const T& m) { return t < m.utime; });
  return after == messages.begin() ? nullptr : &*(after - 1);
}

bool Usable(const pose_t& m) {
  return (m.health == pose_t::HEALTH_OK || m.health == pose_t::HEALTH_DEGRADED) &&
         m.correcting == 0;
}

Eigen::Quaterniond Rotation(const pose_t& m) {
  return bus::ToQuaternion(m.orientation).normalized();
}

/// In frame B, whose axes are uncertain as well.
Eigen::Matrix3d VelocityCovariance(const pose_t& m) {
  const Eigen::Map<const Eigen::Matrix<double, 9, 9, Eigen::RowMajor>> P(m.local_covariance);
  const Eigen::Matrix3d R_BW = Rotation(m).conjugate().toRotationMatrix();
  Eigen::Matrix<double, 3, 6> change;  // of the velocity, by its error and the rotation's
  change << R_BW, R_BW * math::Hat(bus::ToVector(m.vel));
  return change * P.bottomRightCorner<6, 6>() * change.transpose();
}

class Joiner {
 public:
  Joiner(const std::vector<pose_t>& poses, const std::vector<attitude_setpoint_t>& setpoints,
         const std::vector<tracking_t>& tracking)
      : poses_(poses), setpoints_(setpoints), tracking_(tracking) {}

  FlightSamples Join(const std::vector<imu_t>& imu) {
    const int64_t origin = imu.front().utime;
    FlightSamples flight;
    int64_t last = origin;
    for (const imu_t& m : imu) {
      std::optional<Motion> motion;
      if (IsFlown(m.utime)) motion = MotionAt(m);
      if (!motion || m.utime - last > kGap) ++stretch_;
      last = m.utime;
      if (!motion) continue;
      motion->t = bus::Seconds(m.utime, origin);
      motion->stretch = stretch_;
      if (flight.motions.empty() || motion->t > flight.motions.back().t)
        flight.motions.push_back(*motion);
    }
    for (const attitude_setpoint_t& m : setpoints_)
      flight.asked.push_back({bus::Seconds(m.utime, origin),
                              bus::ToQuaternion(m.orientation).normalized(),
                              bus::ToVector(m.body_rate), m.thrust});
    return flight;
  }

 private:
  /// In the air, by plans, with motors on.
  bool IsFlown(int64_t utime) {
    const tracking_t* tracking = LastOf(tracking_, utime);
    const attitude_setpoint_t* setpoint = LastOf(setpoints_, utime);
    const pose_t* pose = LastOf(poses_, utime);
    const bool flown =
        tracking && setpoint && pose &&
        (tracking->following == tracking_t::PLAN || tracking->following == tracking_t::STOP ||
         tracking->following == tracking_t::BRAKE) &&
        setpoint->motors == attitude_setpoint_t::MOTORS_ON && utime - setpoint->utime <= kOld;
    airborne_ = flown && (airborne_ || bus::ToVector(pose->vel).norm() > kAirborne);
    return airborne_;
  }

  /// Between the poses before and after the sample.
  std::optional<Motion> MotionAt(const imu_t& m) const {
    const pose_t* a = LastOf(poses_, m.utime);
    if (!a) return std::nullopt;
    const pose_t* b = a->utime == m.utime ? a : a + 1;
    if (b == poses_.data() + poses_.size() || b->utime - a->utime > kGap) return std::nullopt;
    if (!Usable(*a) || !Usable(*b) || a->epoch != b->epoch) return std::nullopt;
    const double share =
        a == b ? 0.0 : bus::Seconds(m.utime, a->utime) / bus::Seconds(b->utime, a->utime);
    Motion motion;
    const pose_t* later = LastOf(poses_, m.utime + kLearned);
    if (!Usable(*later) || later->epoch != a->epoch) later = a;
    motion.accel = bus::ToVector(m.accel) - bus::ToVector(later->accel_bias);
    motion.w_WB_B = bus::ToVector(m.gyro) - bus::ToVector(later->gyro_bias);
    motion.v_WB = (1.0 - share) * bus::ToVector(a->vel) + share * bus::ToVector(b->vel);
    motion.R_WB = Rotation(*a).slerp(share, Rotation(*b));
    motion.velocity_covariance = VelocityCovariance(*a);
    return motion;
  }

  const std::vector<pose_t>& poses_;
  const std::vector<attitude_setpoint_t>& setpoints_;
  const std::vector<tracking_t>& tracking_;
  bool airborne_ = false;
  int stretch_ = 0;
};

}  // namespace

FlightSamples ReadSamples(const std::string& log, const Watch& watch) {
  Channel<imu_t> imu("IMU");
  Channel<pose_t> poses("POSE");
  Channel<attitude_setpoint_t> setpoints("ATTITUDE_SETPOINT");
  Channel<tracking_t> tracking("TRACKING");
  LogReader reader(log, watch);
  for (LogEvent e; reader.Next(&e);) {
    imu.Take(e);
    poses.Take(e);
    setpoints.Take(e);
    tracking.Take(e);
  }
  const std::vector<imu_t>& samples = imu.Sorted(log);
  return Joiner(poses.Sorted(log), setpoints.Sorted(log), tracking.Sorted(log)).Join(samples);
}

}  // namespace chase::logs
