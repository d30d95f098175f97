#include <ctime>
#include <deque>
#include <utility>

#include "show.h"

namespace chase::perception_stage {

namespace {

constexpr double kTick = 0.005;        // s between poses
constexpr double kSweepDelay = 0.005;  // s from a sweep's end to its arrival

}  // namespace

perception::PerceptionConfig ConfigFor(const world::Scenario& scenario) {
  perception::PerceptionConfig config;
  config.target_radius = scenario.target.radius;
  config.target_height = scenario.target.height;
  return config;
}

std::vector<Outcome> Fly(const Stage& stage, const perception::PerceptionConfig& config) {
  Show show(stage, config.rig);
  perception::Perceiver perceiver(config);
  std::vector<Outcome> outcomes;
  std::deque<std::pair<double, perception::Sweep>> pending;  // by the time of arrival
  const int ticks = static_cast<int>(stage.options().duration / kTick);
  for (int k = 1; k <= ticks; ++k) {  // a frame sees the pose of 5 ms ago as the newest
    const double t = k * kTick;
    if (auto sweep = show.Advance(t)) pending.emplace_back(t + kSweepDelay, std::move(*sweep));
    for (; !pending.empty() && t >= pending.front().first - 1e-9; pending.pop_front())
      perceiver.AddSweep(std::move(pending.front().second));
    if (k % 10 == 0) {
      const Shot shot = show.Image(t);
      const auto target = show.Target(t);
      Outcome out;
      const std::clock_t start = std::clock();  // processor time: others use this machine too
      out.estimate = perceiver.See({t, shot.bgr, {}});
      out.milliseconds = 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
      out.t = t;
      out.visible_share = shot.visible_share;
      out.truth = target.center;
      out.velocity = target.velocity;
      out.range = (target.center - stage.BodyAt(t).p).norm();
      outcomes.push_back(out);
    }
    perceiver.AddPose(show.Pose(t));
  }
  return outcomes;
}

}  // namespace chase::perception_stage
