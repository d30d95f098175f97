#include "services/simulator/truth_feed.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "chase/obstacles_t.hpp"
#include "chase/pose_t.hpp"
#include "chase/target_t.hpp"
#include "common/bus/convert.h"
#include "services/simulator/projection.h"

namespace chase::simulator {
namespace {

using Eigen::Vector3d;

constexpr int64_t kTargetTicks = 10, kObstacleTicks = 20;
constexpr double kForecast = 3.0;   // s that a mover's straight motion is given for
constexpr double kVariance = 1e-6;  // of what is true: small, but never singular
constexpr std::size_t kMostStatics = 60;

world::Obstacle ToObstacle(const world::Solid& solid, int id) {
  world::Obstacle obstacle;
  obstacle.id = id;
  obstacle.shape = EnclosingShape(solid);
  obstacle.center = world::Trajectory::Constant(solid.center, 0.0, kForecast);
  return obstacle;
}

world::Obstacle ToObstacle(const world::MoverState& mover, int id) {
  world::Obstacle obstacle = ToObstacle(mover.solid, id);
  obstacle.moving = true;
  Eigen::Matrix<double, Eigen::Dynamic, 3> rows(2, 3);
  rows << mover.solid.center.transpose(), kForecast * mover.velocity.transpose();
  obstacle.center.coefficients.swap(rows);
  obstacle.position_covariance = obstacle.velocity_covariance =
      kVariance * Eigen::Matrix3d::Identity();
  return obstacle;
}

bool Nearer(const std::pair<double, const world::Obstacle*>& a,
            const std::pair<double, const world::Obstacle*>& b) {
  return a.first < b.first;
}

}  // namespace

Eigen::Matrix3d EnclosingShape(const world::Solid& solid) {
  Vector3d axes = solid.half_size;
  if (solid.kind == world::Solid::Kind::kBox) axes *= std::sqrt(3.0);
  if (solid.kind == world::Solid::Kind::kCylinder)  // (r/a)^2 + (h/c)^2 = 1 at the rims
    axes = axes.cwiseProduct(Vector3d(std::sqrt(1.25), std::sqrt(1.25), std::sqrt(5.0)));
  const Eigen::Matrix3d R = Eigen::AngleAxisd(solid.yaw, Vector3d::UnitZ()).toRotationMatrix();
  return R * axes.cwiseAbs2().cwiseInverse().asDiagonal() * R.transpose();
}

TruthFeed::TruthFeed(bus::Bus& bus, const world::Scenario& scenario, const world::Rig& rig)
    : bus_(bus), rig_(rig) {
  const int first = static_cast<int>(scenario.movers.size());
  for (const auto& solid : world::StaticSolids(scenario)) {
    statics_.push_back(ToObstacle(solid, first + static_cast<int>(statics_.size())));
    reach_.push_back(solid.half_size.norm());
  }
}

void TruthFeed::Publish(const Truth& truth, int64_t utime, int64_t tick) {
  PublishPose(truth, utime);
  if (tick % kTargetTicks == 0) PublishTarget(truth, utime);
  if (tick % kObstacleTicks == 0) PublishObstacles(truth, utime);
}

void TruthFeed::PublishPose(const Truth& truth, int64_t utime) {
  pose_t message{};
  message.utime = utime;
  bus::Set(message.pos, truth.body.p);
  bus::Set(message.vel, truth.body.v);
  bus::Set(message.orientation, truth.body.q);
  bus::Set(message.rotation_rate, truth.body.w);
  bus::Set(message.accel, truth.body.a);
  for (int i = 0; i < 9; ++i) message.covariance[10 * i] = kVariance;
  message.health = pose_t::HEALTH_OK;
  bus_.Publish("POSE", message);
}

void TruthFeed::PublishTarget(const Truth& truth, int64_t utime) {
  const TargetState& target = truth.target;
  target_t message{};
  message.existence = 1.0;
  message.utime = utime;
  message.state = target_t::TRACKING;
  bus::Set(message.mean, target.center);
  bus::Set(message.covariance, Eigen::Matrix3d(100.0 * kVariance * Eigen::Matrix3d::Identity()));
  bus::Set(message.velocity, target.velocity);
  message.radius = target.cylinder.half_size.x();
  message.height = 2.0 * target.cylinder.half_size.z();
  message.score = 1.0;
  const Viewpoint view{truth.body.p + truth.body.q * rig_.camera_position,
                       truth.body.q.toRotationMatrix() * rig_.R_BC()};
  const PixelBox box = ProjectedBox(rig_, view, target.cylinder);
  if (!box.empty()) {
    message.box_px[0] = 0.5 * (box.left + box.right);
    message.box_px[1] = 0.5 * (box.top + box.bottom);
    message.box_px[2] = box.right - box.left;
    message.box_px[3] = box.bottom - box.top;
  }
  bus_.Publish("TARGET", message);
}

std::vector<TruthFeed::Ranked> TruthFeed::NearestStatics(const Vector3d& p_WB) const {
  std::vector<Ranked> list;
  for (std::size_t i = 0; i < statics_.size(); ++i)
    list.emplace_back((statics_[i].center.Position(0.0) - p_WB).norm() - reach_[i], &statics_[i]);
  std::stable_sort(list.begin(), list.end(), Nearer);
  return list;
}

/// The movers and the nearest of the static world, nearest first.
void TruthFeed::PublishObstacles(const Truth& truth, int64_t utime) {
  std::vector<world::Obstacle> movers;
  for (const auto& mover : truth.movers)
    movers.push_back(ToObstacle(mover, static_cast<int>(movers.size())));
  std::vector<Ranked> list = NearestStatics(truth.body.p);
  const std::size_t kept = std::min(list.size(), kMostStatics);
  obstacles_t message{};
  message.n_cut = static_cast<int32_t>(list.size() - kept);
  list.resize(kept);
  for (std::size_t i = 0; i < movers.size(); ++i) {
    const world::Solid& solid = truth.movers[i].solid;
    list.emplace_back((solid.center - truth.body.p).norm() - solid.half_size.norm(), &movers[i]);
  }
  std::stable_sort(list.begin(), list.end(), Nearer);
  message.utime = utime;
  message.n_obstacles = static_cast<int32_t>(list.size());
  for (const auto& entry : list) message.obstacles.push_back(bus::ToMessage(*entry.second, utime));
  bus_.Publish("OBSTACLES", message);
}

}  // namespace chase::simulator
