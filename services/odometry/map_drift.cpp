#include "services/odometry/map_drift.h"

#include <algorithm>
#include <cmath>

namespace chase::odometry {

namespace {

constexpr size_t kMostPlaces = 500;
constexpr double kLeastView = 2.0, kMostView = 50.0;  // m

}  // namespace

void MapDrift::Begin(const Covariance& match) {
  places_.clear();
  covariance_ = inherited_ + config_.first_match * config_.first_match * match;
  covariance_.diagonal().head<3>().array() += config_.first_position * config_.first_position;
  covariance_(3, 3) += config_.first_yaw * config_.first_yaw;
}

void MapDrift::Restart(const Covariance& inherited) {
  inherited_ = inherited;
  Begin(Covariance::Zero());
}

void MapDrift::GoAstray(const Covariance& added) {
  inherited_ += added;
  covariance_ += added;
  for (Place& place : places_) place.covariance += added;
}

/// Error of the map at `to` if it was made from `from` straight on: the heading's error turns the
/// way, and grows along it. The integral of a random walk k over the length d has the variance
/// k^2 d^3 / 3 and the covariance k^2 d^2 / 2 with its end.
MapDrift::Covariance MapDrift::Carried(const Place& from, const Eigen::Vector3d& to) const {
  const Eigen::Vector3d way = to - from.p;
  const double d = way.norm();
  const Eigen::Vector3d across(-way.y(), way.x(), 0.0);  // what a turn by 1 rad does at the end
  Covariance F = Covariance::Identity();
  F.topRightCorner<3, 1>() = across;
  Covariance P = F * from.covariance * F.transpose();
  const double yaw2 = config_.yaw * config_.yaw * d;
  P.diagonal().head<3>().array() +=
      (std::pow(config_.position, 2) + std::pow(config_.slope * view_, 2)) * d;
  P.topLeftCorner<3, 3>() += yaw2 / 3.0 * across * across.transpose();
  P.topRightCorner<3, 1>() += 0.5 * yaw2 * across;
  P.bottomLeftCorner<1, 3>() += 0.5 * yaw2 * across.transpose();
  P(3, 3) += yaw2;
  return P;
}

void MapDrift::MoveTo(const Eigen::Vector3d& p_M, double view) {
  view_ = std::clamp(view, kLeastView, kMostView);
  if (places_.empty()) places_.push_back({p_M, covariance_});
  double nearest = 1e18, best = 1e18;
  const Place* holds = nullptr;
  const Place* close = &places_.back();
  for (const Place& place : places_) {
    const double d = (place.p - p_M).norm();
    if (d < nearest) nearest = d, close = &place;
    if (d > config_.sight) continue;
    const double error = Carried(place, p_M).trace();
    if (error < best) best = error, holds = &place;
  }
  covariance_ = Carried(holds ? *holds : *close, p_M);
  if (nearest > config_.spacing) Remember(p_M);
}

void MapDrift::Remember(const Eigen::Vector3d& p) {
  places_.push_back({p, covariance_});
  if (places_.size() <= kMostPlaces) return;
  const auto farther = [&](const Place& a, const Place& b) {
    return (a.p - p).squaredNorm() < (b.p - p).squaredNorm();
  };
  places_.erase(std::max_element(places_.begin(), places_.end(), farther));
}

}  // namespace chase::odometry
