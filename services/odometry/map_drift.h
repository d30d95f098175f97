#pragma once

#include <Eigen/Core>
#include <vector>

namespace chase::odometry {

struct DriftConfig {
  double yaw = 5e-5;               ///< rad per root m
  double position = 0.0001;        ///< m per root m
  double slope = 6e-5;             ///< rad per root m
  double first_position = 0.0003;  ///< m
  double first_yaw = 1e-4;         ///< rad
  double first_match = 0.7;        ///< 1
  double spacing = 3.0;            ///< m
  double sight = 9.0;              ///< m

  template <class V>
  void Visit(V& v) {
    v("yaw", yaw, "error of heading that the map gathers on its way, rad per root m");
    v("position", position, "the same of its place, m per root m");
    v("slope", slope, "and per metre of the usual distance of what is seen, rad per root m");
    v("first_position", first_position, "error of the map at the start, m");
    v("first_yaw", first_yaw, "the same of its heading, rad");
    v("first_match", first_match, "and share of the deviation of the first match in both");
    v("spacing", spacing, "of the places that are remembered, m");
    v("sight", sight, "a remembered place this near still holds the body, m");
  }
};

/// How far the local map may be off where the body is. A match with the map tells where the body is
/// in it, however often it is repeated; the map itself was placed sweep by sweep, and its heading
/// and place went astray like a random walk along the way on which it was made, the place the more
/// the farther away the surfaces are that it is taken from. Gravity keeps it level. Coming back to
/// a place that was mapped early brings back that place's small error: the shortest chain of
/// remembered places counts.
class MapDrift {
 public:
  using Covariance = Eigen::Matrix4d;  ///< of (p, yaw) of the map: m, rad

  explicit MapDrift(const DriftConfig& config) : config_(config) { Begin(Covariance::Zero()); }

  /// The body is at `p_M` [m] and sees features at a usual distance of `view` [m]; remembers the
  /// place if it is new.
  void MoveTo(const Eigen::Vector3d& p_M, double view);

  /// A new map. What it is made of at first lies as well as the first sweeps match each other:
  /// `match` is the covariance of such a match.
  void Begin(const Covariance& match);

  /// A new map that lies as far astray as `inherited` says, whatever its first match will be.
  void Restart(const Covariance& inherited);

  /// The map goes on from a body that was `added` off: so is all of it, as far as one can tell.
  void GoAstray(const Covariance& added);

  const Covariance& covariance() const { return covariance_; }
  size_t places() const { return places_.size(); }

 private:
  struct Place {
    Eigen::Vector3d p;
    Covariance covariance;
  };
  Covariance Carried(const Place& from, const Eigen::Vector3d& to) const;
  void Remember(const Eigen::Vector3d& p);

  DriftConfig config_;
  double view_ = 8.0;  // m
  Covariance inherited_ = Covariance::Zero();
  Covariance covariance_;
  std::vector<Place> places_;
};

}  // namespace chase::odometry
