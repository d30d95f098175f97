#pragma once

#include <string>
#include <vector>

#include "services/prediction/observation.h"

namespace chase::prediction {

struct WindowConfig {
  int observations = 18;
  double length = 2.4;
  double gate_span = 0.5;
  double gate_sigmas = 4.0;
  double gate_acceleration = 3.0;
  int gate_recovery = 5;
  double sigma_floor = 0.02;

  template <class V>
  void Visit(V& v) {
    v("observations", observations, "at most so many merged observations, 2 to 32");
    v("length", length, "observations older than this are forgotten, s");
    v("gate_span", gate_span, "the gate extrapolates the observations of the last so many s");
    v("gate_sigmas", gate_sigmas, "an observation further off than this is an outlier");
    v("gate_acceleration", gate_acceleration, "that the gate allows for, m/s^2");
    v("gate_recovery", gate_recovery, "so many outliers in a row start the window anew");
    v("sigma_floor", sigma_floor, "least standard deviation of one observation in the gate, m");
  }
  std::string Problem() const;
};

/// The recent past of the target, out of a stream with gaps, duplicates, outliers and stamps out of
/// order.
class ObservationWindow {
 public:
  enum class Outcome {
    kTaken,
    kRestarted,  ///< after outliers in a row: the old ones are dropped
    kOutlier,
    kDuplicate,  ///< an observation with this stamp is there already
    kTooOld,
    kInvalid  ///< not finite
  };

  explicit ObservationWindow(const WindowConfig& config) : config_(config) {}

  Outcome Add(const Observation& observation);
  void Clear();

  int size() const { return static_cast<int>(kept_.size()); }
  /// Stamp of the newest one, s; the window must not be empty.
  double newest() const { return kept_.back().t; }

  /// At most N_o observations, oldest first: the window is cut into N_o equal spans of time, and
  /// what lies in one span is merged, weighted by the inverse covariances. Spans without any are
  /// skipped.
  std::vector<Observation> Merged() const;

 private:
  bool IsOutlier(const Observation& observation) const;
  Outcome TakeOutlier(const Observation& observation);
  void Insert(const Observation& observation);

  WindowConfig config_;
  std::vector<Observation> kept_;      // by time
  std::vector<Observation> outliers_;  // in a row, by arrival
};

}  // namespace chase::prediction
