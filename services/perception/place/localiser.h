#pragma once

#include <optional>
#include <vector>

#include "services/perception/place/target_fit.h"

namespace chase::perception {

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
  /// All readings that agree with the prediction, weighed by their evidence and joined into one
  /// Gaussian; the first alone where it leaves nothing to ask.
  std::optional<FitResult> JoinedReading(FitInput* input) const;
  /// The fit to all sides, if it agrees with all of them and they are enough to tell its range.
  std::optional<FitResult> NewReading(FitInput* input) const;
  std::optional<FitResult> PartialReading(FitInput input) const;
  bool Agrees(const FitResult& fit, const FitInput& input) const;

  PerceptionConfig config_;
};

}  // namespace chase::perception
