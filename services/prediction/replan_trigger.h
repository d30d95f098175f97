#pragma once

#include <optional>
#include <string>

#include "common/math/gaussian.h"
#include "services/prediction/predictor.h"

namespace chase::prediction {

struct TriggerConfig {
  double deviation = 0.15;
  double deviation_sigmas = 2.0;
  double max_age = 0.2;
  double min_period = 0.05;

  template <class V>
  void Visit(V& v) {
    v("deviation", deviation, "predict anew when the target is this far off, m");
    v("deviation_sigmas", deviation_sigmas, "and that is more than so many standard deviations");
    v("max_age", max_age, "predict anew after this, s");
    v("min_period", min_period, "never predict more often than this, s");
  }
  std::string Problem() const;
};

/// Why a prediction is made; the numbers go on the wire.
enum class Cause { kFirst = 0, kDeviation = 1, kExpiry = 2, kObstacle = 3, kReacquired = 4 };

/// Decides when the running prediction has had its time.
class ReplanTrigger {
 public:
  explicit ReplanTrigger(const TriggerConfig& config) : config_(config) {}

  /// What is known at time `now`. `request` holds the obstacles, and the observations that tell
  /// which of them to believe.
  struct Situation {
    double now = 0.0;
    std::optional<math::Gaussian3> observed;  ///< the target as just seen; none while occluded
    const PredictRequest* request = nullptr;
  };

  /// The cause for a new prediction, or none while the running one does.
  std::optional<Cause> Check(const PredictorConfig& predictor, const Situation& situation) const;

  /// The prediction that now runs.
  void Started(const PredictResult& running) { running_ = running; }
  /// The target was lost: the next prediction reacquires it.
  void Lost();

 private:
  bool HasLeft(const math::Gaussian3& observed, double now) const;

  TriggerConfig config_;
  std::optional<PredictResult> running_;
  bool lost_ = false;
};

}  // namespace chase::prediction
