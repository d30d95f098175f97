#include "services/simulator/estimator.h"

#include <algorithm>

#include "common/math/rotation.h"

namespace chase::simulator {
namespace {

using Eigen::Vector3d;

constexpr int64_t kMemory = 1'000'000;   // us
constexpr int64_t kNoAid = 5'000'000;    // us, EKF2_NOAID_TOUT: then its velocity is not valid
constexpr double kTimeConstant = 0.5e6;  // us, with which poses are followed

double Seconds(int64_t us) { return 1e-6 * static_cast<double>(us); }

}  // namespace

void Estimator::Predict(int64_t utime, const BodyState& body, const Vector3d& accel) {
  if (!past_.empty()) {
    const double dt = Seconds(utime - past_.back().utime);
    Vector3d error = body.q * accel - body.a;
    error.z() = 0.0;
    v_error_ += dt * error;
    p_WO_ -= dt * v_error_;
  }
  past_.push_back({utime, body.p, body.v, math::Yaw(body.q)});
  while (past_.front().utime < utime - kMemory) past_.pop_front();
}

void Estimator::Correct(const Vision& vision) {
  if (past_.empty() || !vision.p_OB.allFinite() || !std::isfinite(vision.yaw)) return;
  auto then = past_.rbegin();
  while (std::next(then) != past_.rend() && then->utime > vision.utime) ++then;
  const bool anew = vision.resets != resets_;
  const double since = static_cast<double>(vision.utime - seen_.value_or(vision.utime));
  const double gain = anew ? 1.0 : std::clamp(since / kTimeConstant, 0.0, 1.0);
  if (anew) ++times_reset_;
  resets_ = vision.resets;
  seen_ = std::max(vision.utime, seen_.value_or(vision.utime));
  yaw_WO_ += gain * math::WrapAngle(then->yaw - vision.yaw - yaw_WO_);
  const Eigen::Quaterniond R_WO = math::FromYaw(yaw_WO_);
  p_WO_ += gain * (then->p - R_WO * vision.p_OB - p_WO_);
  if (!vision.v_OB.allFinite()) return;
  v_error_ += gain * (R_WO * vision.v_OB - then->v - v_error_);
  v_error_.z() = 0.0;
}

Px4Body Estimator::Body(const BodyState& body) const {
  const Eigen::Quaterniond R_OW = math::FromYaw(-yaw_WO_);
  Px4Body seen;
  seen.p_WB = R_OW * (body.p - p_WO_);
  seen.v_WB = R_OW * (body.v + v_error_);
  seen.R_WB = R_OW * body.q;
  seen.knows_velocity = seen_ && past_.back().utime - *seen_ <= kNoAid;
  seen.resets = times_reset_;
  return seen;
}

Eigen::Quaterniond Estimator::InWorld(const Eigen::Quaterniond& R_OB) const {
  return math::FromYaw(yaw_WO_) * R_OB;
}

}  // namespace chase::simulator
