#include "services/simulator/vision_frame.h"

#include "common/math/rotation.h"

namespace chase::simulator {
namespace {

constexpr int64_t kMemory = 1'000'000;  // us
constexpr double kGain = 0.05;          // of a pose; with 40 Hz a time constant of 0.5 s

}  // namespace

void VisionFrame::AddTruth(int64_t utime, const BodyState& body) {
  past_.push_back({utime, body.p, math::Yaw(body.q)});
  while (past_.front().utime < utime - kMemory) past_.pop_front();
}

void VisionFrame::AddVision(int64_t utime, const Eigen::Vector3d& p_OB, double yaw, int resets) {
  if (past_.empty()) return;
  auto then = past_.rbegin();
  while (std::next(then) != past_.rend() && then->utime > utime) ++then;
  const double yaw_WO = math::WrapAngle(then->yaw - yaw);
  const bool anew = resets != resets_;
  resets_ = resets;
  yaw_WO_ += (anew ? 1.0 : kGain) * math::WrapAngle(yaw_WO - yaw_WO_);
  const Eigen::Vector3d p_WO = then->p - math::FromYaw(yaw_WO_) * p_OB;
  p_WO_ += (anew ? 1.0 : kGain) * (p_WO - p_WO_);
}

Px4Body VisionFrame::InVision(const BodyState& body) const {
  const Eigen::Quaterniond R_OW = math::FromYaw(-yaw_WO_);
  Px4Body seen;
  seen.p_WB = R_OW * (body.p - p_WO_);
  seen.v_WB = R_OW * body.v;
  seen.R_WB = R_OW * body.q;
  return seen;
}

Eigen::Quaterniond VisionFrame::InWorld(const Eigen::Quaterniond& R_OB) const {
  return math::FromYaw(yaw_WO_) * R_OB;
}

}  // namespace chase::simulator
