#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "chase/obstacles_t.hpp"
#include "chase/prediction_t.hpp"
#include "chase/target_t.hpp"
#include "common/bus/bus.h"
#include "common/bus/epoch.h"
#include "common/bus/node.h"
#include "common/bus/stamp_order.h"
#include "common/world/ages.h"
#include "services/prediction/observation_window.h"
#include "services/prediction/predictor.h"
#include "services/prediction/replan_trigger.h"

namespace chase::prediction {

struct PredictionConfig {
  PredictorConfig predictor;
  WindowConfig window;
  TriggerConfig trigger;
  int min_observations = 3;
  double max_blind = world::kMostAge.target_unseen;
  double no_target_period = 0.5;

  template <class V>
  void Visit(V& v) {
    v("predictor", predictor, "");
    v("window", window, "");
    v("trigger", trigger, "");
    v("min_observations", min_observations, "fewer are nothing to predict from");
    v("max_blind", max_blind, "an occluded target is predicted for this long, s");
    v("no_target_period", no_target_period, "between two messages that there is no target, s");
  }
  std::string Problem() const;
};

/// TARGET and OBSTACLES in, PREDICTION out; every TARGET may trigger.
class PredictionNode : public bus::Node {
 public:
  PredictionNode(bus::Bus& bus, const PredictionConfig& config);
  bus::NodeReport Report() const override;

 private:
  void OnTarget(const target_t& message);
  void OnObstacles(const obstacles_t& message);
  void Predict(const target_t& message, bool seen);
  PredictRequest MakeRequest(const target_t& message) const;
  void Send(const target_t& target, const PredictResult& result, int trigger);
  void SayNoTarget(const target_t& target, const std::string& reason);
  double Time(int64_t utime);

  bus::Bus& bus_;
  PredictionConfig config_;
  Predictor predictor_;
  ObservationWindow window_;
  ReplanTrigger trigger_;
  bus::Epoch epoch_;
  bus::StampOrder order_;
  std::vector<world::Obstacle> obstacles_;
  double obstacles_time_ = 0.0;             // s since origin
  std::optional<int64_t> origin_;           // utime that the core's seconds count from
  std::optional<int64_t> no_target_utime_;  // of the last message that there is none
  PredictResult::Verdict verdict_ = PredictResult::Verdict::kNoTarget;
  std::string reason_ = "no target yet";
  int64_t outliers_ = 0, predictions_ = 0;
};

}  // namespace chase::prediction
