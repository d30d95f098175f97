#pragma once

#include <optional>
#include <vector>

#include "services/perception/place/target_fit.h"

namespace chase::perception {

/// One way to explain a detection: which sides are seen, whether the target turned sharply.
struct Hypothesis {
  FitResult fit;
  double log_weight = 0.0;
};

/// Turns one detection and the LiDAR points on it into a position, or refuses it: what hides part
/// of the target, or only looks like it, must not bend the estimate.
class Localiser {
 public:
  explicit Localiser(const PerceptionConfig& config) : config_(config) {}

  /// Corrects a predicted target. Sides of the silhouette that lie too far inside are taken as
  /// hidden and left out; nothing when no reading of the detection agrees with the prediction.
  std::optional<FitResult> Correct(const FitInput& predicted, const Clusters& clusters) const;

  /// Places a target of which nothing is known: range from the points, or from the apparent size
  /// when no point hits. Nothing when size, points and outline contradict each other.
  std::optional<FitResult> Acquire(const TargetShape& shape, const Camera& camera,
                                   const Detection& detection, const Clusters& clusters) const;

 private:
  /// The fit to all sides, if it agrees with all of them.
  std::optional<FitResult> WholeReading(FitInput* input) const;
  /// All hypotheses that agree with the prediction, weighed and joined into one Gaussian.
  std::optional<FitResult> JoinedReading(FitInput* input) const;
  std::optional<FitResult> PartialReading(FitInput input) const;
  std::optional<FitResult> AcquirePartial(FitInput* input, const Clusters& clusters) const;
  void Weigh(const FitInput& input, double log_prior, size_t readings,
             std::vector<Hypothesis>* out) const;
  bool EdgesAgree(const FitResult& fit, const FitInput& input) const;
  bool Agrees(const FitResult& fit, double prior_gate) const;

  PerceptionConfig config_;
};

}  // namespace chase::perception
