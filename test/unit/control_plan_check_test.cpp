// The check of a plan's proofs: plans of the planner's own pass, forged ones do not. What makes a
// plan a forgery is judged by dense sampling, which shares nothing with the check.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>

#include "common/world/plan_check.h"
#include "test/unit/control_claims.h"

namespace chase::control {
namespace {

using Eigen::Vector3d;
using test::Case;
using test::Random;
using test::Uniform;
using world::Claim;
using world::kTargetBody;
using world::Proof;
using world::Refute;

std::string Verdict(const Case& c) { return Refute(c.claim, c.least, c.obstacles); }

/// Is some plane of the proof no plane between the obstacle and the balls?
bool IsBroken(const Proof& proof, const Claim& claim, const world::Trajectory& way, double flown,
              const world::Obstacle& o) {
  const world::Body body = world::MakeBody(o, way.start, way.duration, claim.sigmas, flown);
  for (const world::Separation& s : proof.separations)
    for (int i = 0; i <= 40; ++i) {
      const double tau = s.from + (s.to - s.from) * i / 40.0, t = way.start + tau * way.duration;
      const Vector3d n = s.normal.normalized();
      const double support =
          n.dot(world::SupportPoint(body, n)) + claim.sigmas * world::Deviation(body, n, tau);
      const auto off = [&](const Vector3d& p, double radius) {
        return n.dot(p - o.center.Position(t)) - support - radius;
      };
      if (off(way.Position(t), proof.radius) < -1e-6) return true;
      if (proof.of_sight &&
          off(claim.target.Position(t), math::Evaluate(proof.target_radius, tau)) < -1e-6)
        return true;
    }
  return false;
}

const world::Obstacle* Find(const Case& c, int id) {
  for (const world::Obstacle& o : c.obstacles)
    if (o.id == id) return &o;
  return nullptr;
}

bool IsBroken(const Case& c, const std::vector<Proof>& proofs, const world::Trajectory& way,
              double flown = HUGE_VAL) {
  for (const Proof& proof : proofs)
    if (const world::Obstacle* o = Find(c, proof.obstacle))
      if (IsBroken(proof, c.claim, way, flown, *o)) return true;
  return false;
}

/// By sampling alone.
bool IsBroken(const Case& c) {
  return IsBroken(c, c.claim.proofs, c.claim.position, c.claim.stop ? 0.4 : HUGE_VAL) ||
         IsBroken(c, c.claim.stop_proofs, *c.claim.stop);
}

/// Any proof about a listed obstacle, of the plan or of its stop.
Proof& AnyProof(Case* c, Random& g) {
  for (;;) {
    auto& proofs = g() % 2 ? c->claim.proofs : c->claim.stop_proofs;
    Proof& proof = proofs[g() % proofs.size()];
    if (proof.obstacle != kTargetBody) return proof;
  }
}

world::Separation& AnyPlane(Case* c, Random& g) {
  auto& planes = AnyProof(c, g).separations;
  return planes[g() % planes.size()];
}

Vector3d Somewhere(Random& g) {
  const double x = Uniform(g, -1, 1), y = Uniform(g, -1, 1), z = Uniform(g, -1, 1);
  return Vector3d(x, y, z).normalized();
}

/// The same stop, written with as many coefficients as the plan.
void RaiseStop(Case* c) {
  Eigen::MatrixXd raised = Eigen::MatrixXd::Zero(c->claim.position.coefficients.rows(), 3);
  raised.topRows(c->claim.stop->coefficients.rows()) = c->claim.stop->coefficients;
  c->claim.stop->coefficients = raised;
}

/// Certified plans with a stop.
const std::vector<Case>& Cases() {
  static const std::vector<Case> cases = [] {
    std::vector<Case> some;
    for (unsigned seed = 1; seed <= 40; ++seed)
      if (Case c = test::MakeCase(seed); c.claim.certified && c.claim.stop) some.push_back(c);
    return some;
  }();
  return cases;
}

/// Changes the case; false where the change need not be a forgery.
using Forgery = std::function<bool(Case*, Random&)>;

bool TurnNormal(Case* c, Random& g) {
  world::Separation& plane = AnyPlane(c, g);
  const Eigen::AngleAxisd turn(Uniform(g, 0.02, M_PI), Somewhere(g));
  plane.normal = turn * plane.normal;
  return IsBroken(*c);
}

bool ShortenInterval(Case* c, Random& g) {
  world::Separation& plane = AnyPlane(c, g);
  const double cut = Uniform(g, 1e-6, 0.5) * (plane.to - plane.from);
  if (g() % 2)
    plane.to -= cut;
  else
    plane.from += cut;
  return true;  // a gap
}

bool EnlargeRadius(Case* c, Random& g) {
  AnyProof(c, g).radius += Uniform(g, 0.01, 2.0);
  return IsBroken(*c);
}

/// Beside the proof that holds, of the same ball and body.
bool EnlargeCopy(Case* c, Random& g) {
  auto& proofs = g() % 2 ? c->claim.proofs : c->claim.stop_proofs;
  const size_t at = g() % proofs.size();
  Proof copy = proofs[at];
  copy.radius += Uniform(g, 0.01, 2.0);
  proofs.insert(proofs.begin() + static_cast<long>(at) + 1, copy);
  return IsBroken(*c);
}

bool EnlargeTargetRadius(Case* c, Random& g) {
  Proof& proof = AnyProof(c, g);
  if (!proof.of_sight) return false;
  proof.target_radius[g() % 2] += Uniform(g, 0.01, 3.0);
  return IsBroken(*c);
}

bool ShrinkRadius(Case* c, Random& g) {
  Proof& proof = AnyProof(c, g);
  proof.radius = c->claim.hard_radius - Uniform(g, 1e-9, 0.3);
  return !proof.of_sight;
}

bool ShrinkHardRadius(Case* c, Random& g) {
  c->claim.hard_radius -= Uniform(g, 1e-9, 0.3);
  return true;
}

bool LowerSigmas(Case* c, Random& g) {
  c->claim.sigmas -= Uniform(g, 1e-9, 2.0);
  return true;
}

bool DropProof(Case* c, Random& g) {
  auto& proofs = g() % 2 ? c->claim.proofs : c->claim.stop_proofs;
  const size_t i = g() % proofs.size();
  const bool needed = !proofs[i].of_sight && proofs[i].obstacle != kTargetBody;
  proofs.erase(proofs.begin() + static_cast<long>(i));
  return needed;
}

bool ShuffleAndTurn(Case* c, Random& g) {
  if (!TurnNormal(c, g)) return false;
  std::shuffle(c->claim.proofs.begin(), c->claim.proofs.end(), g);
  std::shuffle(c->claim.stop_proofs.begin(), c->claim.stop_proofs.end(), g);
  return true;
}

bool DropPlanes(Case* c, Random& g) {
  AnyProof(c, g).separations.clear();
  return true;
}

bool MoveObstacle(Case* c, Random& g) {
  world::Obstacle& o = c->obstacles[g() % c->obstacles.size()];
  o.center.coefficients.row(0) += Uniform(g, 0.01, 3.0) * Somewhere(g).transpose();
  return IsBroken(*c);
}

bool GrowObstacle(Case* c, Random& g) {
  c->obstacles[g() % c->obstacles.size()].shape *= Uniform(g, 0.05, 0.95);
  return IsBroken(*c);
}

bool AddObstacle(Case* c, Random& g) {
  world::Obstacle o = c->obstacles[g() % c->obstacles.size()];
  o.id = 1000;
  c->obstacles.insert(c->obstacles.begin() + static_cast<long>(g() % c->obstacles.size()), o);
  return true;
}

bool ExchangeProofs(Case* c, Random& g) {
  Proof &a = AnyProof(c, g), &b = AnyProof(c, g);
  if (a.of_sight != b.of_sight) return false;
  std::swap(a.separations, b.separations);
  return IsBroken(*c);
}

bool ProveStopAsPlan(Case* c, Random&) {
  RaiseStop(c);
  c->claim.stop_proofs = c->claim.proofs;
  return IsBroken(*c);
}

bool MovePlan(Case* c, Random& g) {
  const int k =
      static_cast<int>(g() % static_cast<unsigned>(c->claim.position.coefficients.rows()));
  c->claim.position.coefficients.row(k) += Uniform(g, 0.01, 3.0) * Somewhere(g).transpose();
  return IsBroken(*c, c->claim.proofs, c->claim.position, c->claim.stop ? 0.4 : HUGE_VAL);
}

bool MoveStop(Case* c, Random& g) {
  c->claim.stop->coefficients.row(0) += Uniform(g, 0.001, 1.0) * Somewhere(g).transpose();
  return true;  // it does not begin on the plan
}

bool ExchangeStop(Case* c, Random& g) {
  const Case& other = Cases()[g() % Cases().size()];
  if (other.seed == c->seed) return false;
  c->claim.stop = other.claim.stop;
  c->claim.stop_proofs = other.claim.stop_proofs;
  return true;
}

bool SpeedStopUp(Case* c, Random& g) {
  c->claim.stop->coefficients.row(1) *= Uniform(g, 1.1, 2.0);
  return c->claim.stop->Velocity(c->claim.stop->start).norm() > 0.1;
}

/// It begins where the plan is then and comes to rest, but not as fast as the plan is.
bool KinkStop(Case* c, Random& g) {
  const Vector3d speed = Uniform(g, 0.01, 0.1) * Somewhere(g);
  const double powers[] = {1.0, -3.0, 3.0, -1.0};  // tau (1 - tau)^3
  for (int k = 0; k < 4; ++k)
    c->claim.stop->coefficients.row(k + 1) += powers[k] * speed.transpose();
  return true;
}

/// It leaves the plan as it should and moves at its end.
bool NeverRest(Case* c, Random& g) {
  const Vector3d speed = Uniform(g, 0.1, 0.3) * Somewhere(g);
  c->claim.stop->coefficients.row(4) += speed.transpose();
  c->claim.stop->coefficients.row(3) -= speed.transpose();
  return true;
}

/// What may start inside may, of what it moves away from.
bool SpeakLater(Case* c, Random& g) {
  Proof& proof = AnyProof(c, g);
  if (proof.of_sight || c->claim.starts_inside) return false;
  proof.from = Uniform(g, 1e-6, 1.0);
  while (proof.separations.size() > 1 && proof.separations.front().to <= proof.from)
    proof.separations.erase(proof.separations.begin());
  proof.separations.front().from = proof.from;
  return true;
}

/// What would make room of uncertainty, where it is taken for one.
bool NegateVariance(Case* c, Random& g) {
  world::Obstacle& o = c->obstacles[g() % c->obstacles.size()];
  Eigen::Matrix3d& S = g() % 2 ? o.position_covariance : o.velocity_covariance;
  const Vector3d n = Somewhere(g);
  S -= (n.dot(S * n) + std::pow(10.0, Uniform(g, -9.0, 1.0))) * n * n.transpose();
  return true;
}

bool TakeCertificateBack(Case* c, Random& /*g*/) {
  c->claim.certified = false;
  return true;
}

const std::map<std::string, Forgery>& Forgeries() {
  static const std::map<std::string, Forgery> all = {
      {"normal turned, another order", ShuffleAndTurn},
      {"normal turned", TurnNormal},
      {"interval shortened", ShortenInterval},
      {"radius enlarged", EnlargeRadius},
      {"a copy of greater radius", EnlargeCopy},
      {"target's radius enlarged", EnlargeTargetRadius},
      {"radius shrunk", ShrinkRadius},
      {"hard radius shrunk", ShrinkHardRadius},
      {"sigmas lowered", LowerSigmas},
      {"proof missing", DropProof},
      {"planes missing", DropPlanes},
      {"obstacle moved", MoveObstacle},
      {"obstacle grown", GrowObstacle},
      {"variance negative", NegateVariance},
      {"obstacle added", AddObstacle},
      {"proofs exchanged", ExchangeProofs},
      {"plan's proofs of the stop", ProveStopAsPlan},
      {"plan moved", MovePlan},
      {"stop moved", MoveStop},
      {"stop exchanged", ExchangeStop},
      {"stop too fast", SpeedStopUp},
      {"stop with a kink", KinkStop},
      {"stop without rest", NeverRest},
      {"proof from later on", SpeakLater},
      {"not certified", TakeCertificateBack}};
  return all;
}

TEST(PlanCheck, TakesThePlannersOwnPlans) {
  int n = 0, sight = 0;
  for (unsigned seed = 1; seed <= 40; ++seed) {
    const Case c = test::MakeCase(seed);
    if (!c.claim.certified) continue;
    EXPECT_EQ(Verdict(c), "") << "seed " << seed;
    EXPECT_FALSE(c.claim.stop && IsBroken(c)) << "seed " << seed;
    for (const Proof& proof : c.claim.proofs) sight += proof.of_sight;
    ++n;
  }
  EXPECT_GE(n, 20);
  EXPECT_GE(sight, 100);
}

TEST(PlanCheck, RefusesTenThousandForgeries) {
  ASSERT_FALSE(Cases().empty());
  const int each = 10000 / static_cast<int>(Forgeries().size()) + 1;
  int taken = 0, made = 0;
  for (const auto& [name, forge] : Forgeries()) {
    Random g(7);
    int n = 0;
    for (int i = 0; n < each && i < 100 * each; ++i) {
      Case c = Cases()[g() % Cases().size()];
      if (!forge(&c, g)) continue;
      ++n;
      if (!Verdict(c).empty()) continue;
      ++taken;
      ADD_FAILURE() << name << ", try " << i << ", seed of the plan " << c.seed;
    }
    EXPECT_EQ(n, each) << name;
    made += n;
  }
  std::printf("%d forgeries of %zu kinds, %d taken\n", made, Forgeries().size(), taken);
  EXPECT_GE(made, 10000);
}

TEST(PlanCheck, NamesObstacleAndWhatIsMissing) {
  Case c = test::MakeCase(1);
  c.claim.proofs.clear();
  EXPECT_EQ(Verdict(c),
            "obstacle " + std::to_string(c.obstacles[0].id) + " has no proof of safety");
  c = test::MakeCase(1);
  c.claim.stop_proofs.clear();
  EXPECT_EQ(Verdict(c).find("stop: obstacle"), 0U) << Verdict(c);
}

TEST(PlanCheck, LastResortsNeedNoCertificateButComeToRest) {
  Claim claim;
  claim.position = world::Trajectory::Constant({1, 2, 3}, 0.0, 1.0);
  claim.target = claim.position;
  EXPECT_EQ(Refute(claim, {0.3, 2.0}, {}), "it is not certified");
  claim.last_resort = true;
  EXPECT_EQ(Refute(claim, {0.3, 2.0}, {}), "");
  claim.position.coefficients = Eigen::MatrixXd::Ones(2, 3);
  EXPECT_EQ(Refute(claim, {0.3, 2.0}, {}), "it neither stops nor ends at rest");
}

TEST(PlanCheck, RestIsLessThanTwoCentimetresASecond) {
  const auto ends_at_rest = [](double speed, double acceleration) {
    world::Trajectory way{0.0, 2.0, Eigen::MatrixXd::Zero(3, 3)};
    way.coefficients(2, 1) = 0.5 * 4.0 * acceleration;
    way.coefficients(1, 1) = 2.0 * (speed - 2.0 * acceleration);  // the speed at the end
    return world::EndsAtRest(way);
  };
  EXPECT_TRUE(ends_at_rest(0.0, 0.0));
  EXPECT_TRUE(ends_at_rest(0.015, 0.0));
  EXPECT_TRUE(ends_at_rest(0.0, 0.04));
  EXPECT_FALSE(ends_at_rest(0.025, 0.0));
  EXPECT_FALSE(ends_at_rest(0.0, -0.06));
}

/// The first obstacle that the plan moves away from for half of its time, or that it does not.
int FirstThat(bool leaves, const Case& c) {
  const world::Trajectory& way = c.claim.position;
  for (size_t i = 0; i < c.obstacles.size(); ++i) {
    const world::Body body = world::MakeBody(c.obstacles[i], way.start, way.duration, 2.0);
    if (world::Leaves(way.coefficients, body, leaves ? 0.5 : 0.2) == leaves)
      return static_cast<int>(i);
  }
  return -1;
}

TEST(PlanCheck, OnlyAnEscapeMayStartInside) {
  Case c = test::MakeCase(1);
  const int away = FirstThat(true, c);
  ASSERT_GE(away, 0);
  world::Obstacle& left = c.obstacles[static_cast<size_t>(away)];
  const auto begin = [&c](double from, int id) {
    for (Proof& proof : c.claim.proofs)
      if (!proof.of_sight && proof.obstacle == id) {
        proof.from = from;
        auto& planes = proof.separations;
        while (planes.front().to <= from) planes.erase(planes.begin());
        planes.front().from = from;
      }
  };
  const std::string later = "obstacle " + std::to_string(left.id) + " is kept off only later";
  begin(0.2, left.id);
  EXPECT_EQ(Verdict(c), later);
  c.claim.starts_inside = true;
  EXPECT_EQ(Verdict(c), "");
  begin(0.5, left.id);
  EXPECT_EQ(Verdict(c), later);
  left.ground = true;
  EXPECT_EQ(Verdict(c), "") << "the ground is left by a climb from rest";
  begin(0.65, left.id);
  EXPECT_EQ(Verdict(c), later);
}

// A hover beside a walker who was listed 0.3 s before: a plan that is left after 0.4 s counts on
// less of what the walker may do than one that is flown to its end; the stop counts on all of it.
TEST(PlanCheck, AMoversChangesOfVelocityCountWhileThePlanIsFlown) {
  constexpr double kStop = 0.4, kHover = 2.0;  // s
  constexpr int kPieces = 32;
  const auto verdict = [](bool stops, double proven, double proven_stop) {
    Case c;
    world::Obstacle walker;
    walker.moving = true;
    walker.position_covariance = walker.velocity_covariance = 0.01 * Eigen::Matrix3d::Identity();
    walker.center = world::Trajectory::Constant(Vector3d::Zero(), 0.7, 1.0);
    c.obstacles = {walker};
    c.claim.certified = true;
    c.claim.hard_radius = 0.3;
    c.claim.sigmas = 2.0;
    const auto hover = [&](double t, double flown, std::vector<Proof>* proofs) {
      const auto way = world::Trajectory::Constant(Vector3d(0.0, 10.0, 0.0), t, kHover);
      const world::Body body = world::MakeBody(walker, t, kHover, 2.0, flown);
      Proof proof;
      for (int i = 0; i < kPieces; ++i)
        proof.separations.push_back(
            {1.0 * i / kPieces, 1.0 * (i + 1) / kPieces, Vector3d::UnitY()});
      const double far = 1.0 + 2.0 * world::Deviation(body, Vector3d::UnitY(), 1.0);
      proof.radius = 10.0 - far - 1e-3;
      proofs->push_back(proof);
      return way;
    };
    c.claim.position = c.claim.target = hover(1.0, proven, &c.claim.proofs);
    if (stops) c.claim.stop = hover(1.0 + kStop, proven_stop, &c.claim.stop_proofs);
    return Verdict(c);
  };
  EXPECT_EQ(verdict(false, kHover, 0.0), "");
  EXPECT_NE(verdict(false, kStop, 0.0), "");
  EXPECT_EQ(verdict(true, kStop, kHover), "");
  EXPECT_NE(verdict(true, 0.0, kHover), "");
  EXPECT_NE(verdict(true, kStop, kStop), "");
}

TEST(PlanCheck, AnEscapeComesNoNearerToWhatItLeaves) {
  Case c = test::MakeCase(1);
  c.claim.starts_inside = true;
  const int toward = FirstThat(false, c);
  ASSERT_GE(toward, 0);
  const int id = c.obstacles[static_cast<size_t>(toward)].id;
  for (Proof& proof : c.claim.proofs)
    if (!proof.of_sight && proof.obstacle == id) {
      proof.from = 0.2;
      auto& planes = proof.separations;
      while (planes.front().to <= 0.2) planes.erase(planes.begin());
      planes.front().from = 0.2;
    }
  EXPECT_EQ(Verdict(c), "obstacle " + std::to_string(id) + " is not left by the shortest way");
}

/// A plan that moves on over [1, 3], and the stop that leaves it at `at`, off by so much.
Claim Leaving(double at, double off, double faster, double duration = 1.5) {
  Claim claim;
  claim.last_resort = true;
  claim.position = {1.0, 2.0, Eigen::MatrixXd::Zero(3, 3)};
  claim.position.coefficients << 0.0, 0.0, 1.0, 2.0, 1.0, 0.0, 0.5, 0.0, 0.0;
  claim.target = claim.position;
  const Vector3d p = claim.position.Position(at), v = claim.position.Velocity(at);
  const Vector3d begin = p + off * Vector3d(0.6, 0.0, 0.8);
  const Vector3d speed = v + faster * Vector3d(0.0, 0.6, 0.8);
  claim.stop = {at, duration, Eigen::MatrixXd::Zero(5, 3)};
  const double powers[] = {1.0, -3.0, 3.0, -1.0};  // tau (1 - tau)^3: to rest where it begins
  claim.stop->coefficients.row(0) = begin.transpose();
  for (int k = 0; k < 4; ++k)
    claim.stop->coefficients.row(k + 1) = powers[k] * duration * speed.transpose();
  return claim;
}

// Within the plan's time, a microsecond more or less, and at most a tenth of a millimetre, and of
// a millimetre a second, off it.
TEST(PlanCheck, AStopLeavesThePlanWhereItIsThen) {
  const auto bad = [](double at, double off = 0.0, double faster = 0.0) {
    return Refute(Leaving(at, off, faster), {0.3, 2.0}, {});
  };
  for (const double at : {1.0, 1.4, 3.0, 1.0 - 5e-7, 3.0 + 5e-7}) EXPECT_EQ(bad(at), "") << at;
  for (const double at : {0.9, 3.1, 1.0 - 3e-6, 3.0 + 3e-6})
    EXPECT_EQ(bad(at), "the stop begins at another time") << at;
  EXPECT_EQ(bad(1.4, 0.9e-4), "");
  EXPECT_EQ(bad(1.4, 0.0, 0.9e-4), "");
  EXPECT_EQ(bad(1.4, 1.1e-4), "the stop begins elsewhere");
  EXPECT_EQ(bad(1.4, 0.0, 1.1e-4), "the stop begins elsewhere");
  Claim claim = Leaving(1.4, 0.0, 0.0, 1e-3);
  EXPECT_EQ(Refute(claim, {0.3, 2.0}, {}), "") << "however short";
  claim.stop->duration = 0.0;
  EXPECT_EQ(Refute(claim, {0.3, 2.0}, {}), "the stop is no curve");
}

// In an order of their own, twice, about others: each that is about what is listed has to hold.
TEST(PlanCheck, TakesProofsInAnyOrder) {
  Random g(9);
  for (int i = 0; i < 60; ++i) {
    Case c = Cases()[g() % Cases().size()];
    for (auto* proofs : {&c.claim.proofs, &c.claim.stop_proofs}) {
      proofs->push_back((*proofs)[g() % proofs->size()]);
      proofs->push_back(proofs->front());
      proofs->back().obstacle = 4711;  // of nothing that is listed
      proofs->back().separations.clear();
      std::shuffle(proofs->begin(), proofs->end(), g);
    }
    std::shuffle(c.obstacles.begin(), c.obstacles.end(), g);
    if (i % 2) RaiseStop(&c);
    EXPECT_EQ(Verdict(c), "") << i;
    c.least.exact = i % 10 == 0;
    EXPECT_TRUE(!c.least.exact || Verdict(c).empty()) << i;
  }
}

TEST(PlanCheck, AsksForTheLeastSphereAndSigmas) {
  Case c = Cases().front();
  c.least.hard_radius = c.claim.hard_radius + 1e-9;
  EXPECT_EQ(Verdict(c), "its sphere is too small");
  c = Cases().front();
  c.least.sigmas = c.claim.sigmas + 1e-9;
  EXPECT_EQ(Verdict(c), "it takes obstacles for more certain than they are");
  c = Cases().front();
  c.claim.hard_radius = std::nan("");
  EXPECT_NE(Verdict(c), "");
}

TEST(PlanCheck, RefusesWhatIsNoCurve) {
  for (const double duration : {0.0, -1.0, std::nan("")}) {
    Case c = Cases().front();
    c.claim.position.duration = duration;
    EXPECT_EQ(Verdict(c), "it is no curve");
    c = Cases().front();
    c.claim.target.duration = duration;
    EXPECT_EQ(Verdict(c), "it is no curve");
    c = Cases().front();
    c.obstacles[0].center.duration = duration;
    EXPECT_EQ(Verdict(c).find("obstacle"), 0U);
  }
  Case c = Cases().front();
  c.claim.target.coefficients.conservativeResize(17, 3);
  c.claim.target.coefficients.bottomRows(17 - 2).setZero();
  EXPECT_EQ(Verdict(c), "it is no curve");
  c = test::MakeCase(1);
  c.claim.position.coefficients = Eigen::MatrixXd::Zero(17, 3);
  EXPECT_EQ(Verdict(c), "it is no curve");
  c = test::MakeCase(1);
  c.obstacles[0].center.coefficients = Eigen::MatrixXd::Zero(17, 3);
  EXPECT_NE(Verdict(c), "");
  c = test::MakeCase(1);
  c.claim.position.coefficients(1, 1) = std::nan("");
  EXPECT_NE(Verdict(c), "");
}

}  // namespace
}  // namespace chase::control
