#include <cmath>
#include <ctime>
#include <deque>
#include <utility>

#include "show.h"

namespace chase::perception_stage {

namespace {

constexpr double kTick = 0.005;        // s between poses
constexpr int kFrameEvery = 10;        // ticks
constexpr double kSweepDelay = 0.005;  // s from a sweep's end to its arrival

}  // namespace

perception::PerceptionConfig ConfigFor(const world::Scenario& scenario) {
  perception::PerceptionConfig config;
  config.target_shape = scenario.target.shape;
  config.target_radius = scenario.target.radius;
  config.target_height = scenario.target.height;
  return config;
}

void Shoot(const Stage& stage, const world::Rig& rig, const std::function<void(Step&&)>& take) {
  Show show(stage, rig);
  std::deque<std::pair<double, perception::Sweep>> pending;  // by the time of arrival
  const int ticks = static_cast<int>(std::lround(stage.options().duration / kTick));
  for (int k = 1; k <= ticks; ++k) {  // a frame sees the pose of 5 ms ago as the newest
    Step step;
    const double t = step.t = step.truth.t = k * kTick;
    if (auto sweep = show.Advance(t)) pending.emplace_back(t + kSweepDelay, std::move(*sweep));
    if (!pending.empty() && t >= pending.front().first - 1e-9) {
      step.arrives = std::move(pending.front().second);
      pending.pop_front();
    }
    if (k % kFrameEvery == 0) {
      const Shot shot = show.Image(t);
      const auto target = show.Target(t);
      step.bgr = shot.bgr;
      step.truth.visible_share = shot.visible_share;
      step.truth.truth = target.center;
      step.truth.velocity = target.velocity;
      step.truth.range = (target.center - stage.BodyAt(t).p).norm();
    }
    step.pose = show.Pose(t);
    take(std::move(step));
  }
}

std::optional<Outcome> Play(const Step& step, perception::Perceiver* perceiver) {
  std::optional<Outcome> out;
  if (step.arrives) perceiver->AddSweep(*step.arrives);
  if (!step.bgr.empty()) {
    out = step.truth;
    const std::clock_t start = std::clock();  // processor time: others use this machine too
    out->estimate = perceiver->See({step.t, step.bgr, {}});
    out->milliseconds = 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  }
  perceiver->AddPose(step.pose);
  return out;
}

std::vector<Outcome> Fly(const Stage& stage, const perception::PerceptionConfig& config) {
  perception::Perceiver perceiver(config);
  std::vector<Outcome> outcomes;
  Shoot(stage, config.rig, [&](Step&& step) {
    if (const auto out = Play(step, &perceiver)) outcomes.push_back(*out);
  });
  return outcomes;
}

}  // namespace chase::perception_stage
