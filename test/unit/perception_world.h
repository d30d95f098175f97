#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>
#include <random>
#include <vector>

#include "services/perception/belief/perceiver.h"

/// A small world of its own for perception's tests: images and sweeps by closed-form ray casting,
/// independent of the simulator and of the code under test (which only lends its message structs).
namespace chase::perception_test {

struct Thing {
  enum class Kind { kCylinder, kBox, kSphere };  // cylinders upright, boxes along the axes
  Kind kind = Kind::kCylinder;
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Vector3d half = Eigen::Vector3d::Ones();  ///< cylinder: r r h/2; sphere: r r r; m
  Eigen::Vector3d rgb = {0.5, 0.5, 0.5};
};

struct Body {
  Eigen::Vector3d p = Eigen::Vector3d::Zero();
  Eigen::Quaterniond R = Eigen::Quaterniond::Identity();
};

inline const Eigen::Vector3d kOrange = {1.0, 0.45, 0.05};

/// What stands where, and how target and drone move. Times s, lengths m, frame W.
struct World {
  world::Rig rig;
  std::vector<Thing> things;                      ///< all but the target
  std::function<Eigen::Vector3d(double)> target;  ///< centre of the cylinder
  std::function<Body(double)> body;
  double target_radius = 0.15, target_height = 0.5;
  Eigen::Vector3d target_rgb = kOrange;
  Eigen::Vector3d light = {1.0, 1.0, 1.0};  ///< tint, r g b
  double image_noise = 4.0;                 ///< grey levels
  double lidar_noise = 0.02, lidar_dropout = 0.02;
  double pose_noise = 0.008, angle_noise_deg = 0.1;
  uint32_t seed = 1;
};

/// Image with the share of the target's own pixels that nothing hides and that lie in the image.
struct Shot {
  cv::Mat bgr;
  double visible_share = 0.0;
  double target_px = 0.0;  ///< pixels of the unhidden target, also outside of the image
  cv::Rect2d box;          ///< of the whole target, px
};

class Renderer {
 public:
  explicit Renderer(const World& world) : world_(world), random_(world.seed) {}

  Shot Image(double t);
  /// One turn from t to t + 0.1, the forward half only; sensor and target move meanwhile.
  perception::Sweep Lidar(double t);
  /// Pose with drifting noise and its true covariance. Ask in the order of time.
  perception::PoseSample Pose(double t);

 private:
  struct Hit {
    double distance = 1e9;
    int thing = -2;  ///< -1: target, -2: ground or walls
    Eigen::Vector3d rgb;
  };
  Hit Cast(const Eigen::Vector3d& o, const Eigen::Vector3d& d, double t, bool things) const;
  double Noise(double sigma) { return sigma * normal_(random_); }

  World world_;
  std::mt19937 random_;
  std::normal_distribution<double> normal_{0.0, 1.0};
  double last_pose_t_ = -1e9;
  Eigen::Vector3d position_error_ = Eigen::Vector3d::Zero(), angle_error_ = Eigen::Vector3d::Zero();
};

/// What came out for one frame, beside the truth.
struct Outcome {
  double t = 0.0, visible_share = 0.0, range = 0.0, milliseconds = 0.0;
  Eigen::Vector3d truth = Eigen::Vector3d::Zero(), velocity = Eigen::Vector3d::Zero();
  perception::TargetEstimate estimate;
};

struct FlyOptions {
  double duration = 10.0;
  bool lidar = true;
  double lidar_delay = 0.002;  ///< s after the end of the sweep
  std::function<void(double t, cv::Mat* bgr)> spoil_image;
  std::function<bool(double t)> pose_arrives;
};

/// Flies through the world and shows everything to a Perceiver at the times when it would arrive.
std::vector<Outcome> Fly(const World& world, const perception::PerceptionConfig& config,
                         const FlyOptions& options = {});

/// A hall with pillars, a winding target at up to 1 m/s on its carrier, drone 2 to 4 m away.
World GymWorld(uint32_t seed);
/// The config of tests with a standing target: it is taken without waiting whether it drives.
perception::PerceptionConfig TakenAtOnce();
/// Drone hovering at the origin 1.2 m up, target standing `distance` m ahead, nothing else.
World StillWorld(double distance);

}  // namespace chase::perception_test
