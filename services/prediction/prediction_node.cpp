#include "services/prediction/prediction_node.h"

#include <fmt/format.h>

#include "common/bus/convert.h"
#include "common/world/ages.h"

namespace chase::prediction {
namespace {

Observation FromMessage(const target_t& m, double t) {
  return {t, bus::ToVector(m.mean), bus::ToMatrix(m.covariance)};
}

int8_t WireVerdict(PredictResult::Verdict verdict) {
  switch (verdict) {
    case PredictResult::Verdict::kOk:
      return prediction_t::OK;
    case PredictResult::Verdict::kColliding:
      return prediction_t::COLLIDING;
    case PredictResult::Verdict::kNoTarget:
      break;
  }
  return prediction_t::NO_TARGET;
}

}  // namespace

std::string PredictionConfig::Problem() const {
  if (min_observations < 2 || min_observations > 100)
    return fmt::format("min_observations: {} is not within 2 to 100", min_observations);
  if (!(max_blind >= 0.0 && max_blind <= 60.0))
    return fmt::format("max_blind: {} is not within 0 to 60", max_blind);
  if (!(no_target_period > 0.0 && no_target_period <= 60.0))
    return fmt::format("no_target_period: {} is not within 0 to 60", no_target_period);
  return "";
}

PredictionNode::PredictionNode(bus::Bus& bus, const PredictionConfig& config)
    : bus_(bus),
      config_(config),
      predictor_(config.predictor),
      window_(config.window),
      trigger_(config.trigger) {
  bus_.Subscribe<target_t>("TARGET", [this](const target_t& m) { OnTarget(m); });
  bus_.Subscribe<obstacles_t>("OBSTACLES", [this](const obstacles_t& m) { OnObstacles(m); });
}

void PredictionNode::OnObstacles(const obstacles_t& message) {
  if (!epoch_.Is(message.epoch)) return;
  obstacles_time_ = Time(message.utime);
  obstacles_.clear();
  for (const obstacle_t& o : message.obstacles) obstacles_.push_back(bus::FromMessage(o, *origin_));
}

void PredictionNode::OnTarget(const target_t& message) {
  const double now = Time(message.utime);
  const bool set_back = order_.Take(message.utime) == bus::StampOrder::Verdict::kSetBack;
  if (epoch_.Change(message.epoch) || set_back) {
    window_.Clear();
    obstacles_.clear();
    trigger_.Lost();
  }
  const bool seen = message.state == target_t::TRACKING;
  if (!seen && message.state != target_t::OCCLUDED) {
    window_.Clear();
    return SayNoTarget(message, "the target is lost");
  }
  if (seen) {
    const auto outcome = window_.Add(FromMessage(message, now));
    outliers_ += outcome == ObservationWindow::Outcome::kOutlier;
  }
  if (window_.size() < config_.min_observations)
    return SayNoTarget(message, "too few observations of the target");
  if (now - window_.newest() > config_.max_blind)
    return SayNoTarget(message, "the target has been out of sight for too long");
  // A stamp from before the newest observation adds to the past and tells nothing new.
  if (now >= window_.newest()) Predict(message, seen);
}

void PredictionNode::Predict(const target_t& message, bool seen) {
  const PredictRequest request = MakeRequest(message);
  ReplanTrigger::Situation situation{request.now, std::nullopt, &request};
  if (seen) situation.observed = {bus::ToVector(message.mean), bus::ToMatrix(message.covariance)};
  std::optional<Cause> cause;
  {
    auto timer = bus_.Time("trigger");
    cause = trigger_.Check(predictor_.config(), situation);
  }
  if (!cause) return;
  PredictResult result;
  {
    auto timer = bus_.Time("predict");
    result = predictor_.Predict(request);
  }
  if (result.verdict == PredictResult::Verdict::kNoTarget)
    return SayNoTarget(message, result.reason);
  trigger_.Started(result);
  Send(message, result, static_cast<int>(*cause));
}

PredictRequest PredictionNode::MakeRequest(const target_t& message) const {
  PredictRequest request;
  request.now = bus::Seconds(message.utime, *origin_);
  request.observations = window_.Merged();
  request.target_radius = message.radius;
  const bool fresh = world::IsFresh(request.now - obstacles_time_, world::kMostAge.obstacles);
  for (const world::Obstacle& o : obstacles_)
    if (!o.ground && (fresh || !o.moving)) request.obstacles.push_back(o);
  return request;
}

void PredictionNode::Send(const target_t& target, const PredictResult& result, int trigger) {
  verdict_ = result.verdict;
  reason_ = result.reason;
  predictions_ += result.verdict != PredictResult::Verdict::kNoTarget;
  no_target_utime_ = result.verdict == PredictResult::Verdict::kNoTarget
                         ? std::optional<int64_t>(target.utime)
                         : std::nullopt;
  prediction_t m{};
  m.utime = target.utime;
  m.epoch = epoch_.value();
  m.verdict = WireVerdict(result.verdict);
  m.reason = result.reason;
  m.target = bus::ToMessage(result.trajectory, *origin_);
  m.target.utime = target.utime;
  bus::Set(m.covariance, result.position_covariance);
  bus::Set(m.velocity_covariance, result.velocity_covariance);
  m.radius = target.radius;
  m.height = target.height;
  m.cost = result.cost;
  m.candidates = result.candidates;
  m.checked = static_cast<int32_t>(std::min<int64_t>(result.checked, INT32_MAX));
  m.trigger = trigger;
  m.existence = target.existence;
  bus_.Publish("PREDICTION", m);
}

// Once when the target goes, then at a low rate.
void PredictionNode::SayNoTarget(const target_t& target, const std::string& reason) {
  trigger_.Lost();
  const int64_t period = static_cast<int64_t>(config_.no_target_period * 1e6);
  if (no_target_utime_ && target.utime >= *no_target_utime_ &&
      target.utime - *no_target_utime_ < period)
    return;
  PredictResult result;
  result.reason = reason;
  result.trajectory = world::Trajectory::Constant(
      Eigen::Vector3d::Zero(), bus::Seconds(target.utime, *origin_), config_.predictor.horizon);
  Send(target, result, static_cast<int>(Cause::kFirst));
}

double PredictionNode::Time(int64_t utime) {
  if (!origin_) origin_ = utime;
  return bus::Seconds(utime, *origin_);
}

bus::NodeReport PredictionNode::Report() const {
  bus::NodeReport report;
  report.detail = fmt::format("{} predictions, {} outliers", predictions_, outliers_);
  if (verdict_ == PredictResult::Verdict::kOk) return report;
  report.detail += ": " + reason_;
  report.state = verdict_ == PredictResult::Verdict::kColliding ? bus::NodeReport::State::kDegraded
                                                                : bus::NodeReport::State::kStarting;
  return report;
}

}  // namespace chase::prediction
