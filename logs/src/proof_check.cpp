#include "logs/src/proof_check.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>
#include <vector>

#include "common/world/ages.h"
#include "common/world/plan_check.h"
#include "logs/src/exact_solid.h"
#include "logs/src/rational.h"

namespace chase::logs {
namespace {

using namespace exact;

constexpr int32_t kTarget = -1;  // whom proofs call so: the target's own body

/// The proofs of one way: the plan's or its stop's.
class Way {
 public:
  Way(const plan_t& plan, const polynomial_t& way, const std::vector<proof_t>& proofs,
      double clearance)
      : plan_(plan),
        proofs_(proofs),
        radius_(Exact(plan.hard_radius) + Exact(clearance)),
        sigmas_(Exact(plan.sigmas)),
        curve_(ToCurve(way)),
        target_(Over(plan.target, way)) {}

  void KeepsOff(const Solid& solid, int32_t id, bool in_sight) {
    const size_t degree = std::max({curve_.size(), target_.size(), solid.center.size()}) - 1;
    if (!drone_ || degree != degree_) SetDegree(degree);
    Pieces center(solid.center, degree_);
    center_ = &center;
    solid_ = &solid;
    bool safe = false, seen = !in_sight;
    for (const proof_t& proof : proofs_) {
      if (proof.obstacle != id) continue;
      Check(proof);
      if (proof.of == proof_t::SAFETY) safe = true;
      seen = seen || (proof.of == proof_t::SIGHT && proof.from <= 0.0);
    }
    Ask(safe, "has no proof of safety");
    Ask(seen, "has no proof of sight over the whole plan");
  }

 private:
  void SetDegree(size_t degree) {
    degree_ = degree;
    drone_.emplace(curve_, degree);
    aim_.emplace(target_, degree);
  }

  void Check(const proof_t& proof) {
    const bool sight = proof.of == proof_t::SIGHT;
    const bool inside = plan_.verdict >= plan_t::BRAKE;  // a last resort, or ESCAPE
    const double leave_by = !inside ? 0.0 : solid_->ground ? kLeaveGroundBy : kLeaveBy;
    Ask(sight || proof.from <= leave_by, "is kept off only later");
    Ask(sight || proof.radius >= plan_.hard_radius, "is kept off a smaller sphere");
    Ask(!proof.separations.empty(), "has a proof without planes");
    Rational reached = Exact(proof.from);
    for (const separation_t& s : proof.separations) {
      const Rational from = Exact(s.from), to = Exact(s.to);
      Ask(from >= 0 && from <= reached && from < to && to <= 1, "has a proof with a gap");
      reached = to;
      CheckPlane(proof, ToVector(s.normal), from, to);
    }
    Ask(reached == 1, "has a proof that ends early");
    if (!sight && proof.from > 0.0) CheckLeaving(Exact(proof.from));
  }

  void CheckPlane(const proof_t& proof, const Vector& n, const Rational& from, const Rational& to) {
    const Rational squared = Dot(n, n);
    Ask(2 * squared >= 1 && squared <= 2, "has a normal of no length");
    const Plane plane{n, RootAbove(squared), solid_->Support(n),
                      Dot(n, Times(solid_->covariance, n)),
                      Dot(n, Times(solid_->velocity_covariance, n))};
    Ask(plane.variance >= 0 && plane.rate >= 0, "has a covariance that is none");
    const bool sight = proof.of == proof_t::SIGHT;
    Rational radius = Exact(proof.radius);
    if (!sight && proof.from <= 0.0 && radius < radius_) radius = radius_;
    Ask(Holds(plane, &*drone_, {radius, 0}, from, to, kDepth),
        sight ? "has a proof of sight that does not hold"
              : "has a proof of safety that does not hold");
    const Linear aim{Exact(proof.target_radius[0]), Exact(proof.target_radius[1])};
    Ask(!sight || Holds(plane, &*aim_, aim, from, to, kDepth),
        "has a proof of sight that does not hold at the target");
  }

  struct Plane {
    Vector n;
    Rational length, support, variance, rate;  // |n|, h, n' P n, n' V n
  };
  struct Linear {
    Rational at_0, slope;
    Rational At(const Rational& tau) const { return at_0 + slope * tau; }
  };

  /// n' (p - c) - h(n) >= |n| radius + sigmas deviations over the piece. The deviation is the norm
  /// of what is affine in tau, so it is convex and below its chord; what is left is a polynomial
  /// above the least of its Bernstein coefficients. Halves tell where the bounds do not.
  bool Holds(const Plane& s, Pieces* ball, const Linear& radius, const Rational& from,
             const Rational& to, int depth) {
    const auto taken = [&](const Rational& tau) {
      const Rational age = solid_->age + solid_->ageing * tau, r = radius.At(tau);
      Ask(r >= 0, "is kept off less than a point");
      return Rational(s.support + s.length * r +
                      sigmas_ * RootAbove(s.variance + age * age * s.rate));
    };
    const Curve &p = ball->On(from, to), &c = center_->On(from, to);
    const Rational first = taken(from), step = (taken(to) - first) / std::max<size_t>(degree_, 1);
    bool holds = true;
    for (size_t i = 0; i <= degree_; ++i) {
      const bool at_end = i == 0 || i == degree_;
      const bool room = Dot(s.n, Minus(p[i], c[i])) >= first + step * i;
      if (!room && at_end) return false;
      holds = holds && room;
    }
    if (holds || depth == 0) return holds;
    const Rational middle = (from + to) / 2;
    return Holds(s, ball, radius, from, middle, depth - 1) &&
           Holds(s, ball, radius, middle, to, depth - 1);
  }

  /// Until then it never goes back along the way out of the solid.
  void CheckLeaving(const Rational& until) {
    const Curve &p = drone_->On(0, until), &c = center_->On(0, until);
    const Vector out = solid_->Outwards(Minus(p[0], c[0]));
    const Rational slack = Exact(kSlack) * RootAbove(Dot(out, out)) * until;
    for (size_t i = 0; i < degree_; ++i)
      Ask(degree_ * Dot(out, Minus(Minus(p[i + 1], p[i]), Minus(c[i + 1], c[i]))) >= -slack,
          "is not left by the shortest way");
  }

  static constexpr int kDepth = 30;
  static constexpr double kSlack = 1e-4;  // m of a unit of tau: stamps are whole microseconds
  static constexpr double kLeaveBy = 0.25, kLeaveGroundBy = 0.6;  // tau

  const plan_t& plan_;
  const std::vector<proof_t>& proofs_;
  Rational radius_, sigmas_;
  Curve curve_, target_;
  size_t degree_ = 0;
  std::optional<Pieces> drone_, aim_;  // of that degree, as is center_
  Pieces* center_ = nullptr;
  const Solid* solid_ = nullptr;
};

/// Position, velocity and acceleration on the way at tau.
Matrix StateAt(const polynomial_t& m, const Rational& tau) {
  Curve x = Substitute(ToCurve(m), tau, 1);
  x.resize(std::max<size_t>(3, x.size()));
  const Rational T = Exact(m.duration);
  for (Rational& v : x[1]) v /= T;
  for (Rational& a : x[2]) a *= 2 / (T * T);
  return {x[0], x[1], x[2]};
}
bool IsBelow(const Vector& v, double bound) { return Dot(v, v) < Exact(bound) * Exact(bound); }

void CheckRest(const plan_t& plan) {
  const bool stops = plan.stop.n_coefficients > 0;
  const Matrix end = StateAt(stops ? plan.stop : plan.position, 1);
  Ask(IsBelow(end[1], 0.02) && IsBelow(end[2], 0.05),  // m/s, m/s^2
      stops ? "the stop does not come to rest" : "neither stops nor ends at rest");
  if (!stops) return;
  const Rational T = Exact(plan.position.duration);
  const Rational since = Seconds(plan.stop.utime) - Seconds(plan.position.utime);
  const Rational stamp(1, 1000000);
  Ask(since >= -stamp && since <= T + stamp, "the stop begins at another time");
  const Matrix left = StateAt(plan.position, since / T), begun = StateAt(plan.stop, 0);
  for (size_t k = 0; k < 2; ++k)  // m, m/s: what a stamp's rounding moves a body by, and more
    Ask(IsBelow(Minus(begun[k], left[k]), 1e-4), "the stop begins elsewhere");
}

/// Until this age planning goes by a list, s; a plan begins some 0.04 s after it is made.
constexpr double kOldest = world::kMostAge.obstacles + 0.1;

void Check(const plan_t& plan, const Grounds& grounds, Examination* result) {
  const bool last_resort = plan.verdict == plan_t::BRAKE || plan.verdict == plan_t::WAIT ||
                           plan.verdict == plan_t::MITIGATE;
  const bool certified = plan.certified_clearance >= 0.0;
  Ask(plan.verdict >= plan_t::CHASE && plan.verdict <= plan_t::MITIGATE, "has no verdict");
  Ask(certified || last_resort, "is not certified");
  Ask(plan.utime == plan.position.utime, "begins at another time than its way");
  CheckRest(plan);
  if (!certified) return;
  Ask(plan.hard_radius >= grounds.hard_radius, "its sphere is smaller than --radius says");
  Ask(plan.sigmas >= std::max(0.0, grounds.sigmas),
      "takes obstacles for more certain than they are");
  Ask(Seconds(plan.utime) - Seconds(grounds.list->utime) <= Exact(kOldest),
      "was made for a list that was too old");
  const bool chases = plan.verdict <= plan_t::KEPT;
  const prediction_t* forecast = grounds.forecast;
  if (forecast && forecast->verdict == prediction_t::NO_TARGET) forecast = nullptr;
  const auto is_that = [&](const polynomial_t& x) {
    return x.utime == plan.target.utime && x.duration == plan.target.duration &&
           x.coefficients == plan.target.coefficients;
  };
  Ask(!chases || !forecast || is_that(forecast->target), "chases what was not forecast");
  const bool is_fresh = forecast && Seconds(plan.utime) - Seconds(forecast->utime) <=
                                        Exact(world::kMostAge.prediction);
  const bool stops = plan.stop.n_coefficients > 0;
  for (const bool of_stop : {false, true}) {
    if (of_stop && !stops) break;
    const polynomial_t& course = of_stop ? plan.stop : plan.position;
    const std::vector<proof_t>& proofs = of_stop ? plan.stop_proofs : plan.proofs;
    // Stamps are whole microseconds, in which what moves does so by less than 10 um.
    const double clearance = of_stop ? 0.0 : std::max(0.0, plan.certified_clearance - 1e-5);
    Way way(plan, course, proofs, clearance);
    std::set<int32_t> known;
    const auto keep_off = [&](const Solid& solid, int32_t id, bool in_sight) {
      known.insert(id);
      try {
        way.KeepsOff(solid, id, in_sight);
      } catch (const Fault& fault) {
        const std::string who = id < 0 ? "the target's body" : "obstacle " + std::to_string(id);
        throw Fault{(of_stop ? "stop: " : "") + who + " " + fault.what};
      }
    };
    for (const obstacle_t& o : grounds.list->obstacles)
      keep_off(SolidOf(o, course, stops && !of_stop ? world::kOverdue : HUGE_VAL), o.id,
               chases && !of_stop && o.kind != obstacle_t::GROUND);
    const auto about_target = [](const proof_t& p) { return p.obstacle == kTarget; };
    const bool told = std::any_of(proofs.begin(), proofs.end(), about_target);
    const bool has_body = forecast && forecast->radius > 0.0 && forecast->height > 0.0;
    if (has_body && (told || chases || is_fresh))
      keep_off(SolidOf(*forecast, course), kTarget, false);
    for (const proof_t& proof : proofs) result->unverified += known.count(proof.obstacle) == 0;
  }
}

}  // namespace

Examination Examine(const plan_t& plan, const Grounds& grounds) {
  Examination result;
  try {
    Check(plan, grounds, &result);
  } catch (const Fault& fault) {
    result.fault = fault.what;
  }
  return result;
}

}  // namespace chase::logs
