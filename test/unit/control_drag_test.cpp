// Drag learnt in flight, against forces made from a known drag and wind.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "services/control/drag_estimate.h"

namespace chase::control {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kStep = 0.005;  // s

/// A body that flies to and fro and turns, and what its accelerometer feels across its z axis.
struct World {
  double drag = 0.25;         // 1/s
  Vector3d wind = {0, 0, 0};  // m/s
  double speed = 1.5;         // m/s, at most
  double noise = 0.0;         // m/s^2
  std::mt19937 random{1};

  void Fly(double seconds, DragEstimate* estimate, double t = 0.0) {
    std::normal_distribution<double> normal(0.0, 1.0);
    for (const double end = t + seconds; t < end; t += kStep) {
      const Matrix3d R = (Eigen::AngleAxisd(0.7 * t, Vector3d::UnitZ()) *
                          Eigen::AngleAxisd(0.3 * std::sin(t), Vector3d::UnitX()))
                             .toRotationMatrix();
      const Vector3d v(speed * std::sin(0.8 * t), 0.5 * speed * std::cos(1.3 * t), 0.0);
      Vector3d force = R.transpose() * Vector3d(-drag * (v - wind));
      force += noise * Vector3d(normal(random), normal(random), 0.0);
      force.z() += 9.81;
      estimate->Add(force, v, R, kStep);
    }
  }
};

TEST(DragEstimate, FindsDragInWindAndNoise) {
  for (const double drag : {0.1, 0.25, 0.6, 1.0})
    for (const double guess : {0.0, 0.25, 0.5})
      for (const Vector3d& wind : {Vector3d(0, 0, 0), Vector3d(1, -2, 0)}) {
        World world;
        world.drag = drag, world.wind = wind, world.noise = 0.5;
        DragEstimate estimate(guess);
        world.Fly(10.0, &estimate);
        EXPECT_NEAR(estimate.value(), drag, 0.05 + 0.2 * std::abs(drag - guess))
            << "ten seconds leave a fifth of the guess; " << drag << " from " << guess << ", wind "
            << wind.transpose();
      }
}

TEST(DragEstimate, StaysAtItsGuessWhereNothingMoves) {
  World world;
  world.speed = 0.0, world.wind = {3.0, 1.0, 0.0}, world.noise = 0.5;
  DragEstimate estimate(0.3);
  world.Fly(30.0, &estimate);
  EXPECT_NEAR(estimate.value(), 0.3, 1e-3) << "a wind is no drag";
}

TEST(DragEstimate, ForgetsAndKeepsWithinBounds) {
  World world;
  world.drag = 0.6;
  DragEstimate estimate(0.25);
  world.Fly(20.0, &estimate);
  world.drag = 0.2;
  world.Fly(40.0, &estimate);
  EXPECT_NEAR(estimate.value(), 0.2, 0.02);
  world.drag = -50.0;
  world.Fly(20.0, &estimate);
  EXPECT_EQ(estimate.value(), 0.0);
  world.drag = 50.0;
  world.Fly(40.0, &estimate);
  EXPECT_NEAR(estimate.value(), 1.25, 1e-9);
  world.Fly(kStep, &estimate);
  estimate.Add({0, 0, 9.81}, {0, 0, 0}, Matrix3d::Identity(), 100.0);
  EXPECT_EQ(estimate.value(), 0.25) << "a long gap leaves the guess";
}

TEST(DragEstimate, ForgetsAllWhereNumbersOverflow) {
  DragEstimate estimate(0.3);
  estimate.Add({1e300, 0, 9.81}, {1e300, 0, 0}, Matrix3d::Identity(), kStep);
  EXPECT_EQ(estimate.value(), 0.3);
}

// The wind turns with the frame that it is told in.
TEST(DragEstimate, ATurnOfTheFrameChangesNothing) {
  const double yaw = 1.1;
  World world;
  world.wind = {3.0, -1.0, 0.0};
  DragEstimate stays(0.4), turns(0.4);
  world.Fly(4.0, &stays);
  world.Fly(4.0, &turns);
  turns.Turn(yaw);
  const Matrix3d turn(Eigen::AngleAxisd(yaw, Vector3d::UnitZ()));
  for (double t = 4.0; t < 8.0; t += kStep) {
    const Vector3d v(std::sin(t), 0.0, 0.0), force = Vector3d(-0.25 * (v - world.wind));
    const Vector3d v2 = turn * v;
    stays.Add(force, v, Matrix3d::Identity(), kStep);
    turns.Add(force, v2, turn, kStep);
  }
  EXPECT_NEAR(stays.value(), turns.value(), 1e-9);
}

}  // namespace
}  // namespace chase::control
