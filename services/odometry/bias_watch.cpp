#include "services/odometry/bias_watch.h"

namespace chase::odometry {

std::optional<NavState> BiasWatch::Judge(const ImuBuffer& imu, const NavState& before, double t,
                                         const PoseMeasurement& z, const UpdateResult& kept) {
  if (!rival_) {
    if (kept.nis <= config_.usual_nis) return std::nullopt;
    rival_ = before;
    evidence_ = 0.0;
    OpenBiases(config_, t - before.t, &*rival_);
  }
  imu.Advance(t, &*rival_);
  const UpdateResult update = Update(config_, z, &*rival_);
  evidence_ += update.log_likelihood - kept.log_likelihood;
  std::optional<NavState> out;
  if (evidence_ > config_.step_evidence) out = rival_;
  if (out || evidence_ <= 0.0) Forget();
  return out;
}

}  // namespace chase::odometry
