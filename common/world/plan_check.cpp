#include "common/world/plan_check.h"

#include <algorithm>
#include <cmath>

#include "common/math/gaussian.h"

namespace chase::world {

namespace {

constexpr Eigen::Index kMostRows = 16;  // of a Curve
// Stamps are whole microseconds, in which a body at 10 m/s and 10 m/s^2 moves by 1e-5 of each unit.
constexpr double kJoin = 1e-4;                 // m, m/s
constexpr double kWayOut = 1e-4;               // m of a unit of tau
constexpr double kLeaveBy = 0.25;              // tau by which planning leaves what the start is in
constexpr double kLeaveGroundBy = 0.6;         // and the ground, out of which it climbs from rest
constexpr double kRestingSpeed = 0.02;         // m/s
constexpr double kRestingAcceleration = 0.05;  // m/s^2

bool IsCurve(const Trajectory& x) {
  return x.coefficients.rows() >= 1 && x.coefficients.rows() <= kMostRows && x.duration > 0.0;
}

/// Proofs of a plan and of its stop among the same obstacles.
class Examiner {
 public:
  Examiner(const Claim& claim, const LeastClaim& least, const std::vector<Obstacle>& obstacles)
      : claim_(claim), exact_(least.exact), obstacles_(obstacles), bodies_(obstacles.size()) {}

  /// `flown`: s of the trajectory for which movers' changes of velocity count.
  std::string Complaint(const Trajectory& of, double flown, const std::vector<Proof>& proofs) {
    of_ = &of;
    flown_ = flown;
    drone_.center = of.coefficients;
    target_.center = claim_.target.Reparametrised(of.start, of.duration).coefficients;
    swept_drone_ = SweptBall(drone_);
    swept_target_ = SweptBall(target_);
    is_safe_.assign(obstacles_.size(), 0);
    body_ = nullptr;
    for (const Proof& proof : proofs) {
      if (proof.obstacle == kTargetBody || !Find(proof.obstacle)) continue;
      if (std::string bad = Complaint(proof); !bad.empty()) return About(proof.obstacle, bad);
      if (!proof.of_sight) is_safe_[at_] = 1;
    }
    for (size_t i = 0; i < obstacles_.size(); ++i)
      if (!is_safe_[i]) return About(obstacles_[i].id, "has no proof of safety");
    return "";
  }

 private:
  static std::string About(int id, const std::string& what) {
    return "obstacle " + std::to_string(id) + " " + what;
  }

  // Proofs come in the order of the list: the search goes on where the last one ended.
  bool Find(int id) {
    if (body_ && obstacles_[at_].id == id) return true;
    body_ = nullptr;
    for (size_t i = 0; i < obstacles_.size(); ++i, at_ = (at_ + 1) % obstacles_.size())
      if (obstacles_[at_].id == id) return true;
    return false;
  }

  std::string Complaint(const Proof& proof) {
    const double leave_by = obstacles_[at_].ground ? kLeaveGroundBy : kLeaveBy;
    if (!proof.of_sight && proof.from > (claim_.starts_inside ? leave_by : 0.0))
      return "is kept off only later";
    if (!proof.of_sight && !(proof.radius >= claim_.hard_radius))
      return "is kept off a smaller sphere";
    const Obstacle& obstacle = obstacles_[at_];
    if (!IsCurve(obstacle.center)) return "moves in no way that can be checked";
    if (!body_ && !(math::IsCovariance(obstacle.position_covariance) &&
                    math::IsCovariance(obstacle.velocity_covariance)))
      return "has a covariance that is not positive semidefinite";
    if (!body_) SetBody(obstacle);
    const bool holds = Holds(proof);
    if (holds && (proof.of_sight || proof.from <= 0.0 ||
                  Leaves(of_->coefficients, *body_, proof.from, kWayOut)))
      return "";
    if (holds) return "is not left by the shortest way";
    return proof.of_sight ? "has a proof of sight that does not hold"
                          : "has a proof of safety that does not hold";
  }

  void SetBody(const Obstacle& obstacle) {
    std::optional<Body>& body = bodies_[at_];
    if (body)
      Retime(obstacle, of_->start, of_->duration, claim_.sigmas, flown_, &*body);
    else
      body = MakeBody(obstacle, of_->start, of_->duration, claim_.sigmas, flown_);
    body_ = &*body;
  }

  bool Holds(const Proof& proof) {
    drone_.radius = math::Polynomial::Constant(1, proof.radius);
    swept_drone_.TakeRadius();
    if (proof.of_sight) target_.radius = proof.target_radius;
    if (proof.of_sight) swept_target_.TakeRadius();
    if (exact_)
      return IsCertificateExact(proof.separations, proof.from, 1.0, drone_,
                                proof.of_sight ? &target_ : nullptr, *body_);
    return IsCertificate(proof.separations, proof.from, 1.0, &swept_drone_,
                         proof.of_sight ? &swept_target_ : nullptr, *body_);
  }

  const Claim& claim_;
  const bool exact_;
  const std::vector<Obstacle>& obstacles_;
  std::vector<std::optional<Body>> bodies_;  // of the obstacles, as far as they were asked of

  // Of the trajectory in hand.
  const Trajectory* of_ = nullptr;
  double flown_ = 0.0;
  std::vector<char> is_safe_;
  Ball drone_, target_;
  SweptBall swept_drone_{drone_}, swept_target_{target_};
  const Body* body_ = nullptr;  // that of obstacles_[at_]
  size_t at_ = 0;
};

std::string RefuteStop(const Claim& claim) {
  const Trajectory& plan = claim.position;
  const Trajectory& stop = *claim.stop;
  if (!IsCurve(stop)) return "the stop is no curve";
  if (!(stop.start >= plan.start - 1e-6 && stop.start <= plan.end() + 1e-6))
    return "the stop begins at another time";
  if (!((stop.Position(stop.start) - plan.Position(stop.start)).norm() <= kJoin &&
        (stop.Velocity(stop.start) - plan.Velocity(stop.start)).norm() <= kJoin))
    return "the stop begins elsewhere";
  return EndsAtRest(stop) ? "" : "the stop does not come to rest";
}

}  // namespace

bool EndsAtRest(const Trajectory& position) {
  return position.Velocity(position.end()).norm() < kRestingSpeed &&
         position.Acceleration(position.end()).norm() < kRestingAcceleration;
}

std::string Refute(const Claim& claim, const LeastClaim& least,
                   const std::vector<Obstacle>& obstacles) {
  if (!IsCurve(claim.position) || !IsCurve(claim.target)) return "it is no curve";
  if (!claim.certified && !claim.last_resort) return "it is not certified";
  if (!claim.stop && !EndsAtRest(claim.position)) return "it neither stops nor ends at rest";
  if (claim.stop)
    if (std::string bad = RefuteStop(claim); !bad.empty()) return bad;
  if (!claim.certified) return "";
  if (!(claim.hard_radius >= least.hard_radius)) return "its sphere is too small";
  if (!(claim.sigmas >= least.sigmas)) return "it takes obstacles for more certain than they are";
  const double flown = claim.stop ? kOverdue : HUGE_VAL;
  Examiner examiner(claim, least, obstacles);
  std::string bad = examiner.Complaint(claim.position, flown, claim.proofs);
  if (!bad.empty() || !claim.stop) return bad;
  bad = examiner.Complaint(*claim.stop, HUGE_VAL, claim.stop_proofs);
  return bad.empty() ? "" : "stop: " + bad;
}

}  // namespace chase::world
