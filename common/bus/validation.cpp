#include "common/bus/validation.h"

#include <cmath>
#include <string>
#include <vector>

#include "common/bus/convert.h"
#include "common/bus/image_format.h"
#include "common/math/gaussian.h"
#include "common/world/commands.h"

namespace chase::bus {

namespace {

constexpr double kMaxMagnitude = 1e7;  // no quantity on the bus comes near this

bool Sane(double x) { return std::isfinite(x) && std::abs(x) < kMaxMagnitude; }

template <int N>
bool Sane(const double (&values)[N]) {
  for (const double x : values)
    if (!Sane(x)) return false;
  return true;
}

bool Sane(const std::vector<double>& values) {
  for (const double x : values)
    if (!Sane(x)) return false;
  return true;
}

/// Collects the first complaint.
class Check {
 public:
  template <class T>
  Check& Number(const char* field, const T& value) {
    return That(Sane(value), field, "is not a finite number below 1e7");
  }
  Check& That(bool holds, const char* field, const char* what) {
    if (!holds && problem_.empty()) problem_ = std::string("field ") + field + " " + what;
    return *this;
  }
  Check& Time(int64_t utime) { return That(utime >= 0, "utime", "is negative"); }
  Check& Quaternion(const double (&q)[4]) {
    Number("orientation", q);
    const double n = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    return That(std::abs(n - 1.0) < 1e-2, "orientation", "is not a unit quaternion");
  }
  Check& Polynomial(const char* field, const polynomial_t& p) {
    That(std::isfinite(p.duration) && p.duration > 0.0 && p.duration < 1e4, field,
         "has a duration that is not positive");
    That(p.n_coefficients >= 3 && p.n_coefficients <= 3 * 16 && p.n_coefficients % 3 == 0, field,
         "has a number of coefficients that is not 3 to 48 in steps of 3");
    return Number(field, p.coefficients);
  }
  Check& Probability(const char* field, double value) {
    return That(value >= 0.0 && value <= 1.0, field, "is not a probability");
  }
  Check& Stop(const polynomial_t& p) {
    return p.n_coefficients == 0 ? *this : Polynomial("stop", p);
  }
  Check& Proofs(const char* field, const std::vector<proof_t>& proofs) {
    for (const proof_t& p : proofs) {
      Code(field, p.of, 1).Number(field, p.from).Number(field, p.radius);
      Number(field, p.target_radius);
      for (const separation_t& s : p.separations)
        Number(field, s.from).Number(field, s.to).Number(field, s.normal);
    }
    return *this;
  }
  Check& Covariance(const char* field, const double (&upper)[6]) {
    return Number(field, upper).Covariance(field, ToSymmetric(upper));
  }
  Check& Covariance(const char* field, const double (&rows)[9]) {
    return Number(field, rows)
        .Covariance(field, Eigen::Matrix3d(Eigen::Map<const Eigen::Matrix3d>(rows)));
  }
  Check& Covariance(const char* field, const Eigen::Matrix3d& m) {
    return That(math::IsCovariance(m), field, "is not positive semidefinite");
  }
  Check& Code(const char* field, int value, int last) {
    return That(value >= 0 && value <= last, field, "is not one of the constants");
  }
  std::string Result() const { return problem_; }

 private:
  std::string problem_;
};

bool SomeFinite(const std::vector<float>& x) {
  for (const float v : x)
    if (std::isfinite(v)) return true;
  return x.empty();
}

bool Positive(const double (&s)[6]) {
  // Sylvester: the three leading minors of [xx xy xz; xy yy yz; xz yz zz].
  const double m2 = s[0] * s[3] - s[1] * s[1];
  const double det = s[0] * (s[3] * s[5] - s[4] * s[4]) - s[1] * (s[1] * s[5] - s[4] * s[2]) +
                     s[2] * (s[1] * s[4] - s[3] * s[2]);
  return s[0] > 0.0 && m2 > 0.0 && det > 0.0;
}

}  // namespace

std::string Problem(const attitude_setpoint_t& m) {
  return Check()
      .Time(m.utime)
      .Quaternion(m.orientation)
      .Number("body_rate", m.body_rate)
      .Number("thrust", m.thrust)
      .That(m.thrust >= 0.0, "thrust", "is negative")
      .Code("motors", m.motors, 1)
      .Result();
}

std::string Problem(const camera_image_t& m) {
  const int64_t raw = static_cast<int64_t>(m.row_stride) * m.height;
  const bool whole = m.pixelformat == kPixelFormatMjpeg ? m.size > 0 : raw == m.size;
  const bool shape = m.width > 0 && m.height > 0 && m.row_stride > 0 && m.width <= 16384 &&
                     m.height <= 16384 && whole;
  return Check()
      .Time(m.utime)
      .That(shape, "size", "does not agree with height and row_stride")
      .Result();
}

std::string Problem(const command_ack_t& m) {
  return Check()
      .Time(m.utime)
      .Code("kind", m.kind, world::kSelectCommand)
      .Code("verdict", m.verdict, command_ack_t::UNKNOWN)
      .Result();
}

std::string Problem(const command_t& m) {
  return Check()
      .Time(m.utime)
      .Code("kind", m.kind, world::kSelectCommand)
      .Number("arguments", m.arguments)
      .Result();
}

std::string Problem(const event_t& m) {
  return Check().Time(m.utime).Code("phase", m.phase, 1).Result();
}

std::string Problem(const flight_state_t& m) {
  return Check()
      .Time(m.utime)
      .Code("state", m.state, flight_state_t::EMERGENCY)
      .Code("has_home", m.has_home, 1)
      .Number("home", m.home)
      .Result();
}

std::string Problem(const geofence_t& m) {
  return Check()
      .Time(m.utime)
      .That(m.n_corners >= 6 && m.n_corners % 2 == 0, "corners", "are fewer than 3")
      .Number("corners", m.corners)
      .Number("floor", m.floor)
      .Number("ceiling", m.ceiling)
      .That(m.floor < m.ceiling, "floor", "is not below the ceiling")
      .Result();
}

std::string Problem(const health_t& m) {
  Check check;
  check.Time(m.utime);
  for (const process_health_t& p : m.processes)
    check.Code("state", p.state, status_t::FAILED).Number("age", p.age);
  return check.Result();
}

std::string Problem(const imu_t& m) {
  return Check().Time(m.utime).Number("accel", m.accel).Number("gyro", m.gyro).Result();
}

std::string Problem(const lidar_scan_t& m) {
  return Check().Time(m.utime).That(SomeFinite(m.x), "x", "holds no finite number").Result();
}

std::string Problem(const map_t& m) {
  return Check()
      .Time(m.utime)
      .Number("resolution", m.resolution)
      .That(m.resolution > 0.0, "resolution", "is not positive")
      .Result();
}

std::string Problem(const obstacles_t& m) {
  Check check;
  check.Time(m.utime);
  for (const auto& o : m.obstacles) {
    check.Polynomial("center", o.center).Number("shape", o.shape).Code("kind", o.kind, 2);
    check.That(Positive(o.shape), "shape", "is not positive definite");
    check.Code("solid", o.solid, 2).Number("half", o.half);
    if (o.solid != obstacle_t::ELLIPSOID)
      check.That(o.half[0] > 0.0 && o.half[1] > 0.0 && o.half[2] > 0.0, "half", "is not positive")
          .Quaternion(o.orientation);
    check.Covariance("position_covariance", o.position_covariance)
        .Covariance("velocity_covariance", o.velocity_covariance)
        .Probability("existence", o.existence);
  }
  return check.Result();
}

std::string Problem(const plan_t& m) {
  return Check()
      .Time(m.utime)
      .Code("verdict", m.verdict, plan_t::MITIGATE)
      .Polynomial("position", m.position)
      .That(m.n_yaw >= 1 && m.n_yaw <= 16, "n_yaw", "is not 1 to 16")
      .Number("yaw", m.yaw)
      .Polynomial("target", m.target)
      .Number("hard_radius", m.hard_radius)
      .Number("sigmas", m.sigmas)
      .Number("certified_clearance", m.certified_clearance)
      .Proofs("proofs", m.proofs)
      .Stop(m.stop)
      .Proofs("stop_proofs", m.stop_proofs)
      .Result();
}

std::string Problem(const pose_t& m) {
  return Check()
      .Time(m.utime)
      .Number("pos", m.pos)
      .Number("vel", m.vel)
      .Quaternion(m.orientation)
      .Number("rotation_rate", m.rotation_rate)
      .Number("accel", m.accel)
      .Number("gyro_bias", m.gyro_bias)
      .Number("accel_bias", m.accel_bias)
      .Number("covariance", m.covariance)
      .Number("local_covariance", m.local_covariance)
      .Code("health", m.health, 3)
      .Result();
}

std::string Problem(const prediction_t& m) {
  return Check()
      .Time(m.utime)
      .Code("verdict", m.verdict, 2)
      .Polynomial("target", m.target)
      .Covariance("covariance", m.covariance)
      .Covariance("velocity_covariance", m.velocity_covariance)
      .Number("radius", m.radius)
      .Number("height", m.height)
      .Probability("existence", m.existence)
      .Result();
}

std::string Problem(const scan_registered_t& m) {
  return Check()
      .Time(m.utime)
      .Number("pos", m.pos)
      .Quaternion(m.orientation)
      .Code("health", m.health, 3)
      .That(SomeFinite(m.x), "x", "holds no finite number")
      .Result();
}

std::string Problem(const scenario_t& m) {
  return Check().Time(m.utime).That(!m.yaml.empty(), "yaml", "is empty").Result();
}

std::string Problem(const selection_t& m) {
  return Check()
      .Time(m.utime)
      .Number("hue_min", m.hue_min)
      .Number("hue_max", m.hue_max)
      .Number("saturation_min", m.saturation_min)
      .Number("value_min", m.value_min)
      .Number("aspect", m.aspect)
      .Number("fill", m.fill)
      .Number("inset", m.inset)
      .Number("outline_sigma", m.outline_sigma)
      .Result();
}

std::string Problem(const status_t& m) {
  return Check()
      .Time(m.utime)
      .Code("state", m.state, 3)
      .Number("cpu", m.cpu)
      .Number("uptime", m.uptime)
      .Result();
}

std::string Problem(const target_t& m) {
  return Check()
      .Time(m.utime)
      .Code("state", m.state, 3)
      .Number("mean", m.mean)
      .Number("covariance", m.covariance)
      .Number("velocity", m.velocity)
      .Number("velocity_covariance", m.velocity_covariance)
      .Probability("existence", m.existence)
      .Number("radius", m.radius)
      .Number("height", m.height)
      .Number("box_px", m.box_px)
      .Number("score", m.score)
      .Result();
}

std::string Problem(const tracking_t& m) {
  return Check()
      .Time(m.utime)
      .Code("following", m.following, 4)
      .Number("error", m.error)
      .Number("bound", m.bound)
      .Result();
}

std::string Problem(const truth_t& m) {
  return Check()
      .Time(m.utime)
      .Number("mission_time", m.mission_time)
      .Number("pos", m.pos)
      .Number("vel", m.vel)
      .Quaternion(m.orientation)
      .Number("target_pos", m.target_pos)
      .Result();
}

}  // namespace chase::bus
