#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/world/scenario.h"
#include "services/perception/belief/perceiver.h"

/// Flights for perception made with the simulator's own world, camera and LiDAR: the target drives
/// its scenario's path, the drone follows it on rails, poses carry the errors of odometry.
namespace chase::perception_stage {

/// Errors of odometry's poses beside a slow turn and shift of its whole world, measured on flights
/// of the gym and the forest: the tilt that the accelerometer's bias leaves stays for a flight, the
/// position wanders. What odometry claims of itself is less.
struct OdometryErrors {
  double tilt = 0.006, heading = 0.002;                      ///< of a flight, rad
  Eigen::Vector3d position = {0.006, 0.006, 0.008};          ///< m
  double correlation = 5.0;                                  ///< of the position, s
  double velocity = 0.004;                                   ///< m/s, from sample to sample
  double claimed_position = 0.0037, claimed_angle = 0.0013;  ///< m, rad
};

struct StageOptions {
  std::string scenario = "deploy/scenarios/gym.yaml";
  uint64_t seed = 1;
  double duration = 20.0;  ///< s
  double light = 1.0;      ///< share of the day's
  bool distractors = true, screens = true, warm = true;
  bool absent = false;  ///< no target is there, nor a thing just like it
  OdometryErrors errors;
};

/// A flight's cast: the scenario with what the seed adds to it, and the drone's rails.
class Stage {
 public:
  explicit Stage(const StageOptions& options);

  struct Body {
    Eigen::Vector3d p = Eigen::Vector3d::Zero();
    Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  };
  /// The drone at t s after the flight's start. Frame W.
  Body BodyAt(double t) const;

  const world::Scenario& scenario() const { return scenario_; }
  const std::vector<world::Solid>& orange() const { return orange_; }
  double mission_start() const { return start_; }
  Eigen::Vector3d light() const { return light_; }
  const StageOptions& options() const { return options_; }

 private:
  Eigen::Vector2d Rail(double t) const;
  Eigen::Vector2d Smooth(double t) const;
  double Delay(double t) const;
  void AddDistractors();
  void AddScreens();

  StageOptions options_;
  world::Scenario scenario_;
  world::PathMotion path_;
  double start_ = 0.0;
  double base_delay_ = 2.0, delay_swing_ = 0.5, sway_ = 0.25, rise_ = 0.6;
  double phase_[4] = {};
  Eigen::Vector3d light_ = Eigen::Vector3d::Ones();
  std::vector<world::Solid> orange_;
};

/// What came out for one frame, beside the truth.
struct Outcome {
  double t = 0.0;              ///< s
  double visible_share = 0.0;  ///< of all the target's pixels, those outside the image included
  double range = 0.0;          ///< from the body, m
  double milliseconds = 0.0;   ///< processor time
  Eigen::Vector3d truth = Eigen::Vector3d::Zero(), velocity = Eigen::Vector3d::Zero();
  perception::TargetEstimate estimate;
};

/// The config that a flight of this scenario gives perception.
perception::PerceptionConfig ConfigFor(const world::Scenario& scenario);

/// What a Perceiver gets in one 5 ms step of a flight, and the truth.
struct Step {
  double t = 0.0;                            ///< s
  std::optional<perception::Sweep> arrives;  ///< before the frame
  cv::Mat bgr;                               ///< a frame, or empty
  perception::PoseSample pose;               ///< after the frame
  Outcome truth;                             ///< of the frame; without estimate
};

/// Hands the steps of a flight to `take` in the order of time.
void Shoot(const Stage& stage, const world::Rig& rig, const std::function<void(Step&&)>& take);

/// Shows a step to a Perceiver; the outcome where it holds a frame.
std::optional<Outcome> Play(const Step& step, perception::Perceiver* perceiver);

/// Flies and shows everything to a Perceiver when it would arrive.
std::vector<Outcome> Fly(const Stage& stage, const perception::PerceptionConfig& config);

}  // namespace chase::perception_stage
