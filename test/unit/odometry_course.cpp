#include "test/unit/odometry_course.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>

#include "common/math/rotation.h"

namespace chase::odometry::test {

namespace {

double CpuMilliseconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

Visit Compared(const PoseEstimate& estimate, const Flight& flight) {
  const Pose truth = flight.X_WB(estimate.t);
  Visit visit;
  visit.estimate = estimate;
  visit.position_error = (estimate.X_WB.p - truth.p).norm();
  visit.velocity_error = (estimate.v - flight.Velocity(estimate.t)).norm();
  visit.yaw_error = math::LogSO3(estimate.X_WB.R * truth.R.conjugate()).z();
  return visit;
}

void Process(Odometry* odometry, const Flight& flight, CourseResult* result, double* total,
             int* count) {
  while (odometry->SweepReady()) {
    const double start = CpuMilliseconds();
    SweepResult out = odometry->ProcessSweep();
    const double spent = CpuMilliseconds() - start;
    *total += spent;
    ++*count;
    result->worst_sweep_ms = std::max(result->worst_sweep_ms, spent);
    if (out.pose) result->visits.push_back(Compared(*out.pose, flight));
    if (out.registered) result->sweeps.push_back(std::move(*out.registered));
  }
}

double Rms(const std::vector<Visit>& visits, double from, double Visit::*field) {
  double sum = 0.0, n = 0.0;
  for (const Visit& visit : visits)
    if (visit.estimate.t >= from) sum += visit.*field * (visit.*field), n += 1.0;
  return n > 0.0 ? std::sqrt(sum / n) : std::numeric_limits<double>::infinity();
}

}  // namespace

CourseResult Fly(const Course& course, const OdometryConfig& config) {
  Odometry odometry(config);
  Noise noise(course.seed);
  const Pose X_BL{math::ExpSO3(course.mount_error) * Eigen::Quaterniond(config.rig.R_BL()),
                  config.rig.lidar_position};
  const auto X_WL = [&](double t) { return course.flight.X_WB(t) * X_BL; };
  CourseResult result;
  double total = 0.0;
  int count = 0;
  for (int i = 0; i * 0.005 <= course.duration; ++i) {
    const double t = 0.005 * i;
    ImuSample imu = Measure(course.flight, t, course.sensors, &noise);
    if (!course.on_imu || course.on_imu(&imu))
      if (const auto pose = odometry.AddImu(imu))
        result.visits.push_back(Compared(*pose, course.flight));
    if (i > 0 && i % 20 == 0) {
      Hall hall = course.hall;
      hall.ends_open |= t > course.corridor_from && t <= course.corridor_to;
      Sweep sweep = Scan(hall, X_WL, t - 0.1, course.sensors, &noise);
      if (!course.on_sweep || course.on_sweep(&sweep)) odometry.AddSweep(std::move(sweep));
    }
    Process(&odometry, course.flight, &result, &total, &count);
  }
  result.sweep_cpu_ms = total / std::max(count, 1);
  return result;
}

OdometryConfig ConfigFor(const Flight& flight) {
  OdometryConfig config;
  config.initial_position = flight.start;
  config.filter.mount_sigma = 1e-4;  // the mounting is exact here
  return config;
}

double CourseResult::PositionRms(double from) const {
  return Rms(visits, from, &Visit::position_error);
}

double CourseResult::VelocityRms(double from) const {
  return Rms(visits, from, &Visit::velocity_error);
}

double CourseResult::WorstPosition(double from, double to) const {
  double worst = 0.0;
  for (const Visit& visit : visits)
    if (visit.estimate.t >= from && visit.estimate.t <= to)
      worst = std::max(worst, visit.position_error);
  return worst;
}

double CourseResult::WorstJump() const {
  double worst = 0.0;
  for (size_t i = 1; i < visits.size(); ++i)
    worst = std::max(worst, std::abs(visits[i].position_error - visits[i - 1].position_error));
  return worst;
}

double CourseResult::FirstTime(double from, bool ok) const {
  for (const Visit& visit : visits)
    if (visit.estimate.t >= from && (visit.estimate.health.health == Health::kOk) == ok)
      return visit.estimate.t;
  return std::numeric_limits<double>::infinity();
}

bool CourseResult::Finite() const {
  return std::all_of(visits.begin(), visits.end(), [](const Visit& visit) {
    const PoseEstimate& e = visit.estimate;
    return e.X_WB.p.allFinite() && e.X_WB.R.coeffs().allFinite() && e.v.allFinite() &&
           e.covariance.allFinite() && e.w_B.allFinite() && e.a.allFinite();
  });
}

}  // namespace chase::odometry::test
