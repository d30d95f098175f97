#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "services/planning/stopping.h"

namespace chase::planning {

inline constexpr double kLongestBrake = 3.0;  ///< s

/// Durations of a braking that are tried, s.
inline constexpr double kBrakeTimes[] = {0.6, 0.8, 1.0, 1.3, 1.7, 2.2, kLongestBrake};

/// To rest over T, wherever that leads or at `end`: of all ways that continue position, velocity
/// and acceleration of s the one of least squared jerk. Mueller, Hehn and D'Andrea 2015, section
/// III and appendix A (the end's position free).
Curve BrakeCurve(const world::State& s, double T);
Curve CurveTo(const world::State& s, double T, const Eigen::Vector3d& end);

/// Distance of a point, `d` from its centre, to the solid; of an ellipsoid to first order (Taubin
/// 1991, eq. 3).
double DistanceTo(const world::Obstacle& o, const Eigen::Vector3d& d);

/// Comes to rest from the request's start, or from other states; sight is not asked for.
class Resting {
 public:
  /// Keeps references to both. `besides`: more obstacles; `memory`: where the problem is made, if
  /// given.
  Resting(const PlannerConfig& config, const PlanRequest& request,
          std::vector<world::Obstacle> besides = {}, Problem* memory = nullptr)
      : config_(config),
        request_(request),
        besides_(std::move(besides)),
        problem_(memory ? *memory : own_) {
    From(request.start, request.t0);
  }
  Resting(const Resting&) = delete;  // problem_ may be its own

  void From(const world::State& start, double t0);
  /// What the start is in, of what is listed, is no obstacle to leave, but one in the way.
  void KeepOff() { leaves_ = false; }

  /// The quickest that is certified, within the heights, or else as far beyond as the quickest way
  /// must.
  std::optional<Stop> Brake();
  std::optional<Stop> BrakeWithin(bool heights = true);

  /// The quickest that is certified and ends above the target's body, so that it passes below;
  /// where there is none, or braking does, Brake().
  std::optional<Stop> RiseOrBrake();

  /// To the nearest place that is certified, straight away from the target's body, aslant or aside.
  std::optional<Stop> StepAside();

  /// A certified way over T, if the curve is one.
  std::optional<Stop> Certified(const Curve& curve, double T);

  /// Is whoever stays at the end of `stop` certified clear until t, s? Another start after that.
  bool Lasts(const Stop& stop, double t);

  /// Within the limits of speed and acceleration.
  bool CanBeFlown(const Curve& curve, double T);

  /// Time of the first contact, s, interpolated between samples, infinite where there is none, and
  /// the least clearance. The ground and the greatest height count as an obstacle's surface. Where
  /// the map has a static obstacle at the start it is wrong, as the body is there: going as far in
  /// as the quickest braking is no contact with it, and to flee it is no gain.
  std::pair<double, double> Harm(const Curve& curve, double T);

 private:
  const world::Obstacle& Obstacle(size_t j) const;
  bool IsForecast(const Curve& way, double T) const;
  std::pair<double, double> Clearances(const Curve& curve, double tau) const;
  std::pair<double, double> Within();
  /// What the last way touched, when that was.
  bool TouchesAgain(const Curve& curve, double T) const;
  bool LeavesListed(const std::vector<Proof>& proofs) const;
  void SetProblem(double T);

  const PlannerConfig& config_;
  const PlanRequest& request_;
  const std::vector<world::Obstacle> besides_;
  Stretch over_;
  Problem own_;
  Problem& problem_;
  Curve heights_;
  bool leaves_ = true;
  bool beyond_ = true, goes_beyond_ = false;  ///< the heights: may it, and would the quickest way
  std::optional<bool> made_beyond_;           ///< as the problem was made; none: to be made anew
  std::optional<std::pair<double, double>> within_;
  struct Touched {
    int obstacle;  ///< index of Obstacle()
    double tau;
    double radius;  ///< m, that is kept to it
  };
  std::optional<Touched> touched_;  ///< by the newest way from this start that touched anything
};

}  // namespace chase::planning
