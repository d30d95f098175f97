#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

#include "common/world/obstacle.h"
#include "common/world/trajectory.h"
#include "services/prediction/observation.h"
#include "services/prediction/predictor_config.h"

namespace chase::prediction {

/// What the prediction starts from. Frame W; one clock for all times, s.
struct PredictRequest {
  std::vector<Observation> observations;  ///< any order, at most 32; those after `now` are left out
  double now = 0.0;
  double target_radius = 0.0;  ///< m; obstacles grow by `inflation` times this
  std::vector<world::Obstacle> obstacles;
};

struct PredictResult {
  enum class Verdict {
    kOk,         ///< the optimum of Problem 1 over the candidates; certified clear on [0,T]
    kColliding,  ///< no candidate is known to be clear: the least bad one, see `free_share`
    kNoTarget    ///< nothing to predict from; `trajectory` is meaningless
  };
  Verdict verdict = Verdict::kNoTarget;
  std::string reason;  ///< why the verdict is not kOk

  world::Trajectory trajectory;  ///< p_WT over [now, now + horizon]
  double cost = 0.0;             ///< objective of Problem 1, m^2/s^3
  double gap = 0.0;              ///< no clear candidate costs less than cost (1 - gap); 0: optimum
  int64_t candidates = 0;        ///< N_v^N_o
  int64_t checked = 0;           ///< tested against obstacles one by one
  int64_t nodes = 0;             ///< opened by the search
  int obstacles = 0;             ///< within reach of the candidates
  /// The least bad candidate is the cheapest one that is clear of all obstacles shrunk about their
  /// centres to this share of their size: the largest of 1, 0.7, 0.4 and 0 for which there is one.
  double free_share = 1.0;
  Eigen::Matrix3d position_covariance = Eigen::Matrix3d::Zero();  ///< at now, m^2
  Eigen::Matrix3d velocity_covariance = Eigen::Matrix3d::Zero();  ///< at now, m^2/s^2
};

/// Forecasts the target. Jeon 2021, section III.
class Predictor {
 public:
  explicit Predictor(const PredictorConfig& config) : config_(config) {}

  /// The optimum of Problem 1 over all arrangements, or the reason there is none. Never throws;
  /// the same request gives the same result, bit for bit.
  PredictResult Predict(const PredictRequest& request) const;

  const PredictorConfig& config() const { return config_; }

 private:
  PredictorConfig config_;
};

/// True when `trajectory` keeps clear of `obstacles`, prepared as Predict prepares them, from `now`
/// to its end. `observations` are those that it was made of.
bool StaysClear(const PredictorConfig& config, const PredictRequest& request,
                const world::Trajectory& trajectory);

}  // namespace chase::prediction
