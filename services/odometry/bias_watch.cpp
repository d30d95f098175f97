#include "services/odometry/bias_watch.h"

#include <cmath>

namespace chase::odometry {

namespace {

// Six directions exceed 22 in the sum of their squares once in a thousand times.
constexpr double kSurprise = 22.0 / 6.0;
// s; half its square times 0.25 m/s^2 is 11 mm: by then a step of the accelerometer has shown
// itself. One of the gyroscope does within a sweep.
constexpr double kUnseen = 0.3;
constexpr double kAgreed = 0.1;  // both filters explain a match as well as that: nothing to tell

}  // namespace

std::optional<NavState> BiasWatch::Judge(const ImuBuffer& imu, const NavState& before, double t,
                                         const PoseMeasurement& z, const UpdateResult& kept) {
  if (!rival_) {
    if (kept.nis <= kSurprise) return std::nullopt;
    rival_ = before;
    evidence_ = 0.0;
    OpenBiases(config_, kUnseen, t - before.t, &*rival_);
  }
  imu.Advance(t, &*rival_);
  const double ratio = Update(config_, z, &*rival_).log_likelihood - kept.log_likelihood;
  evidence_ += ratio;
  std::optional<NavState> out;
  if (evidence_ > config_.step_evidence) out = rival_;
  if (std::abs(evidence_) > config_.step_evidence || std::abs(ratio) < kAgreed) Forget();
  return out;
}

}  // namespace chase::odometry
