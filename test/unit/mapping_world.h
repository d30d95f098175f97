#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <random>
#include <vector>

#include "services/mapping/sweep.h"

namespace chase::mapping::testing {

/// A box, upright, turned about z by `yaw`. Frame W, m.
struct Box {
  Eigen::Vector3d center, half;
  double yaw = 0.0;
};

/// An upright cylinder.
struct Cylinder {
  Eigen::Vector2d center;
  double radius = 0.28, bottom = 0.0, top = 3.0;
};

/// Closed-form ray casting of boxes, cylinders and a gently rough ground: what a 16-ring sensor
/// sees. Shares nothing with the mapper or the simulator.
class World {
 public:
  std::vector<Box> boxes;
  std::vector<Cylinder> cylinders;
  double roughness = 0.0, wavelength = 8.0;  ///< of the ground, m

  double Ground(double x, double y) const;
  /// Distance to the first surface along a unit vector, infinity if there is none. `object` (if
  /// given): 0 ground, then boxes, then cylinders, from 1.
  double Cast(const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
              int* object = nullptr) const;
};

/// 8 m x 15 m hall with 4 m walls and seven pillars of 0.56 m diameter. x in [0,15], y in [0,8].
World Gym();
/// The pillars' centres.
std::vector<Eigen::Vector2d> GymPillars();
/// A way through the gym: position at time t, at walking speed; z about 1.3 m.
Eigen::Vector3d GymFlight(double t);

/// Trunks of 0.15 to 0.4 m radius with gaps of 2.5 m, seeded.
World Forest(double side, int trunks, unsigned seed);

struct SensorNoise {
  double range = 0.02;  ///< standard deviation, m
  double pose = 0.01;   ///< of the position, per axis, m
  double yaw = 0.0;     ///< rad
};

/// What a sweep hit, point for point: the true place and the object.
struct Truth {
  std::vector<Eigen::Vector3d> points;
  std::vector<int> objects;
};

/// 16 rings from -15 to 15 degrees, 1800 azimuths; returns within 100 m, registered with an
/// erroneous pose.
Sweep Scan(const World& world, const Eigen::Vector3d& at, double t, const SensorNoise& noise,
           std::mt19937* random, Truth* truth = nullptr,
           const Eigen::Quaterniond& R_WL = Eigen::Quaterniond::Identity());

}  // namespace chase::mapping::testing
