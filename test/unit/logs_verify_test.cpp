// The check of plans by chase-log verify: plans of the planner's own pass, forged messages do not,
// and it agrees with the check that control flies by. What makes a message a forgery is judged by
// dense sampling.

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <random>

#include "common/bus/convert.h"
#include "common/bus/plan_message.h"
#include "common/world/body.h"
#include "logs/src/proof_check.h"
#include "test/unit/planning_instances.h"

namespace chase::logs {
namespace {

using Eigen::Vector3d;
using Random = std::mt19937;

double Uniform(Random& g, double low, double high) {
  return std::uniform_real_distribution<double>(low, high)(g);
}
Vector3d Somewhere(Random& g) {
  const double x = Uniform(g, -1, 1), y = Uniform(g, -1, 1), z = Uniform(g, -1, 1);
  return Vector3d(x, y, z).normalized();
}

/// What goes over the wire.
struct Wire {
  unsigned seed = 0;
  plan_t plan{};
  obstacles_t list{};
  prediction_t forecast{};
};

const double kRadius = planning::PlannerConfig{}.hard_radius(),
             kSigmas = planning::PlannerConfig{}.sigmas;
constexpr int32_t kTarget = -1;

std::string Fault(const Wire& w) {
  return Examine(w.plan, {&w.list, &w.forecast, kRadius, kSigmas}).fault;
}

/// A third of the obstacles are boxes, a third upright cylinders; half are uncertain.
planning::PlanRequest Request(const planning::PlannerConfig& config, unsigned seed) {
  planning::InstanceSpec spec;
  spec.horizon = 2.5;
  spec.n_obstacles = 12;
  planning::PlanRequest request = planning::InstanceGenerator(config, spec).Make(seed);
  request.target_sigma = 0.02;
  for (world::Obstacle& o : request.obstacles) {
    const Vector3d half = o.shape.diagonal().cwiseInverse().cwiseSqrt();
    if (o.id % 3 == 1) o.solid = world::Obstacle::Solid::kBox, o.half = half / std::sqrt(3.0);
    if (o.id % 3 == 2) {
      o.solid = world::Obstacle::Solid::kCylinder;
      o.half = {0.6 * half.x(), 0.6 * half.x(), 0.6 * half.z()};
    }
    if (o.id % 3 == 1) o.axes = Eigen::AngleAxisd(0.3 * o.id, Vector3d(0.1, 0.2, 1).normalized());
    if (o.solid != world::Obstacle::Solid::kEllipsoid)
      o.shape = (3.0 * o.half.cwiseAbs2()).cwiseInverse().asDiagonal();
    if (o.moving)  // listed a while before
      o.center = o.center.Reparametrised(request.t0 - 0.25, o.center.duration);
    if (o.id % 2) o.position_covariance = 4e-4 * Eigen::Matrix3d::Identity();
    if (o.id % 4 == 1) o.velocity_covariance = 1e-3 * Eigen::Matrix3d::Identity();
  }
  world::Obstacle body;
  body.id = kTarget;
  body.center = request.target;
  body.solid = world::Obstacle::Solid::kCylinder;
  body.half = {0.2, 0.2, 0.3};
  body.shape = body.half.cwiseAbs2().cwiseInverse().asDiagonal();
  body.position_covariance = 4e-4 * Eigen::Matrix3d::Identity();
  request.target_body = body;
  return request;
}

Wire MakeWire(unsigned seed) {
  constexpr int64_t kOrigin = 1'000'000'000;
  const planning::PlannerConfig config;
  const planning::PlanRequest request = Request(config, seed);
  const planning::PlanResult plan = planning::MakePlanner("chase", config)->Plan(request);
  Wire w;
  w.seed = seed;
  w.plan.position = bus::ToMessage(plan.trajectory, kOrigin);
  w.plan.utime = w.list.utime = w.plan.position.utime;
  w.plan.verdict = static_cast<int8_t>(plan.verdict);
  w.plan.target = w.forecast.target = bus::ToMessage(request.target, kOrigin);
  w.plan.hard_radius = config.hard_radius();
  w.plan.sigmas = config.sigmas;
  w.plan.certified_clearance = plan.certified_clearance;
  w.plan.proofs = bus::ToMessage(plan.proofs);
  if (plan.stop) w.plan.stop = bus::ToMessage(*plan.stop, kOrigin);
  w.plan.stop_proofs = bus::ToMessage(plan.stop_proofs);
  for (const world::Obstacle& o : request.obstacles)
    w.list.obstacles.push_back(bus::ToMessage(o, kOrigin));
  w.forecast.radius = 0.2, w.forecast.height = 0.6;
  bus::Set(w.forecast.covariance, request.target_body->position_covariance);
  return w;
}

/// Certified plans with a stop.
const std::vector<Wire>& Wires() {
  static const std::vector<Wire> wires = [] {
    std::vector<Wire> some;
    for (unsigned seed = 1; seed <= 40; ++seed)
      if (Wire w = MakeWire(seed); w.plan.certified_clearance >= 0.0 && !w.plan.stop_proofs.empty())
        some.push_back(w);
    return some;
  }();
  return wires;
}

world::Obstacle TargetBody(const Wire& w) {
  world::Obstacle body;
  body.center = bus::FromMessage(w.forecast.target, w.plan.utime);
  body.solid = world::Obstacle::Solid::kCylinder;
  body.half = {w.forecast.radius, w.forecast.radius, 0.5 * w.forecast.height};
  body.position_covariance = bus::ToMatrix(w.forecast.covariance);
  body.velocity_covariance = bus::ToMatrix(w.forecast.velocity_covariance);
  return body;
}

/// Is some plane of the proof no plane between the solid and the balls?
bool IsBroken(const Wire& w, const proof_t& proof, const world::Trajectory& way, double flown,
              const world::Obstacle& o) {
  const world::Body body = world::MakeBody(o, way.start, way.duration, w.plan.sigmas, flown);
  const world::Trajectory target = bus::FromMessage(w.plan.target, w.plan.utime);
  for (const separation_t& s : proof.separations)
    for (int i = 0; i <= 40; ++i) {
      const double tau = s.from + (s.to - s.from) * i / 40.0, t = way.start + tau * way.duration;
      const Vector3d n = bus::ToVector(s.normal).normalized();
      const double support =
          n.dot(world::SupportPoint(body, n)) + w.plan.sigmas * world::Deviation(body, n, tau);
      const auto off = [&](const Vector3d& p, double radius) {
        return n.dot(p - o.center.Position(t)) - support - radius;
      };
      if (off(way.Position(t), proof.radius) < -1e-6) return true;
      const double radius = proof.target_radius[0] + tau * proof.target_radius[1];
      if (proof.of == proof_t::SIGHT && off(target.Position(t), radius) < -1e-6) return true;
    }
  return false;
}

/// By sampling alone.
bool IsBroken(const Wire& w) {
  for (const bool stop : {false, true}) {
    const auto way = bus::FromMessage(stop ? w.plan.stop : w.plan.position, w.plan.utime);
    const double flown = stop || w.plan.stop.coefficients.empty() ? way.duration : 0.4;
    for (const proof_t& proof : stop ? w.plan.stop_proofs : w.plan.proofs) {
      if (proof.obstacle == kTarget && IsBroken(w, proof, way, flown, TargetBody(w))) return true;
      for (const obstacle_t& o : w.list.obstacles)
        if (o.id == proof.obstacle &&
            IsBroken(w, proof, way, flown, bus::FromMessage(o, w.plan.utime)))
          return true;
    }
  }
  return false;
}

proof_t& AnyProof(Wire* w, Random& g) {
  auto& proofs = g() % 2 ? w->plan.proofs : w->plan.stop_proofs;
  return proofs[g() % proofs.size()];
}
separation_t& AnyPlane(Wire* w, Random& g) {
  auto& planes = AnyProof(w, g).separations;
  return planes[g() % planes.size()];
}
obstacle_t& AnyObstacle(Wire* w, Random& g) {
  return w->list.obstacles[g() % w->list.obstacles.size()];
}
void Move(double* at, const Vector3d& by) {
  for (int a = 0; a < 3; ++a) at[a] += by[a];
}
bool Turn(separation_t* plane, double angle, Random& g) {
  bus::Set(plane->normal, Eigen::AngleAxisd(angle, Somewhere(g)) * bus::ToVector(plane->normal));
  return true;
}

/// Changes the messages; false where the change need not be a forgery.
using Forgery = std::function<bool(Wire*, Random&)>;

const std::map<std::string, Forgery>& Forgeries() {
  static const std::map<std::string, Forgery> all = {
      {"normal turned",
       [](Wire* w, Random& g) {
         return Turn(&AnyPlane(w, g), Uniform(g, 0.02, M_PI), g) && IsBroken(*w);
       }},
      {"normal turned, another order",
       [](Wire* w, Random& g) {
         Turn(&AnyPlane(w, g), Uniform(g, 0.02, M_PI), g);
         std::shuffle(w->plan.proofs.begin(), w->plan.proofs.end(), g);
         std::shuffle(w->plan.stop_proofs.begin(), w->plan.stop_proofs.end(), g);
         return IsBroken(*w);
       }},
      {"normal of no length",
       [](Wire* w, Random& g) {
         const double by = g() % 2 ? 0.0 : 2.0;
         for (double& x : AnyPlane(w, g).normal) x *= by;
         return true;
       }},
      {"interval shortened",
       [](Wire* w, Random& g) {
         separation_t& plane = AnyPlane(w, g);
         const double cut = Uniform(g, 1e-6, 0.5) * (plane.to - plane.from);
         if (g() % 2)
           plane.to -= cut;
         else
           plane.from += cut;
         return true;
       }},
      {"radius enlarged",
       [](Wire* w, Random& g) {
         AnyProof(w, g).radius += Uniform(g, 0.01, 2.0);
         return IsBroken(*w);
       }},
      {"radius shrunk",
       [](Wire* w, Random& g) {
         proof_t& proof = AnyProof(w, g);
         proof.radius = w->plan.hard_radius - Uniform(g, 1e-9, 0.3);
         return proof.of == proof_t::SAFETY;
       }},
      {"radius negative",
       [](Wire* w, Random& g) {
         proof_t& proof = AnyProof(w, g);
         (proof.of == proof_t::SIGHT ? proof.target_radius[0] : proof.radius) = -0.1;
         return true;
       }},
      {"hard radius shrunk",
       [](Wire* w, Random& g) {
         w->plan.hard_radius -= Uniform(g, 1e-9, 0.3);
         return true;
       }},
      {"sigmas lowered",
       [](Wire* w, Random& g) {
         w->plan.sigmas -= Uniform(g, 1e-9, 2.0);
         return true;
       }},
      {"clearance raised",
       [](Wire* w, Random& g) {
         w->plan.certified_clearance += Uniform(g, 0.02, 1.0);
         Wire enlarged = *w;
         for (proof_t& p : enlarged.plan.proofs)
           if (p.of == proof_t::SAFETY)
             p.radius = std::max(
                 p.radius, p.from > 0.0 ? 0.0 : w->plan.hard_radius + w->plan.certified_clearance);
         return IsBroken(enlarged);
       }},
      {"proof missing",
       [](Wire* w, Random& g) {
         auto& proofs = g() % 2 ? w->plan.proofs : w->plan.stop_proofs;
         const size_t i = g() % proofs.size();
         const bool chases = w->plan.verdict <= plan_t::KEPT;
         const bool needed =
             chases || (proofs[i].of == proof_t::SAFETY && proofs[i].obstacle != kTarget);
         proofs.erase(proofs.begin() + static_cast<long>(i));
         return needed;
       }},
      {"sight later",
       [](Wire* w, Random& g) {
         proof_t& proof = w->plan.proofs[g() % w->plan.proofs.size()];
         proof.from = Uniform(g, 1e-6, 0.999);
         return proof.of == proof_t::SIGHT && w->plan.verdict <= plan_t::KEPT;
       }},
      {"planes missing",
       [](Wire* w, Random& g) {
         AnyProof(w, g).separations.clear();
         return true;
       }},
      {"obstacle moved",
       [](Wire* w, Random& g) {
         Move(AnyObstacle(w, g).center.coefficients.data(), Uniform(g, 0.01, 3.0) * Somewhere(g));
         return IsBroken(*w);
       }},
      {"obstacle grown",
       [](Wire* w, Random& g) {
         obstacle_t& o = AnyObstacle(w, g);
         const double by = Uniform(g, 1.05, 4.0);
         for (double& x : o.shape) x /= by * by;
         for (double& x : o.half) x *= by;
         return IsBroken(*w);
       }},
      {"obstacle less certain",
       [](Wire* w, Random& g) {
         obstacle_t& o = AnyObstacle(w, g);
         for (const int i : {0, 3, 5})
           (g() % 2 ? o.position_covariance : o.velocity_covariance)[i] += Uniform(g, 1e-3, 1.0);
         return IsBroken(*w);
       }},
      {"obstacle listed long ago",
       [](Wire* w, Random& g) {
         obstacle_t& o = AnyObstacle(w, g);
         o.center.utime -= 1000 * (100 + g() % 3000);
         return IsBroken(*w);
       }},
      {"obstacle of no size",
       [](Wire* w, Random& g) {
         obstacle_t& o = AnyObstacle(w, g);
         o.half[g() % 3] = -0.1;
         return o.solid != obstacle_t::ELLIPSOID;
       }},
      {"obstacle added",
       [](Wire* w, Random& g) {
         obstacle_t o = AnyObstacle(w, g);
         o.id = 1000;
         w->list.obstacles.push_back(o);
         return true;
       }},
      {"list too old",
       [](Wire* w, Random& g) {
         w->list.utime -= 401'000 + static_cast<int64_t>(g() % 5'000'000);
         return true;
       }},
      {"target's body grown",
       [](Wire* w, Random& g) {
         w->forecast.radius += Uniform(g, 0.1, 3.0);
         return IsBroken(*w);
       }},
      {"target's body less certain",
       [](Wire* w, Random& g) {
         for (const int i : {0, 4, 8}) w->forecast.velocity_covariance[i] += Uniform(g, 0.1, 3.0);
         return IsBroken(*w);
       }},
      {"target elsewhere",
       [](Wire* w, Random& g) {
         Move(w->plan.target.coefficients.data(), Uniform(g, 1e-6, 3.0) * Somewhere(g));
         return w->plan.verdict <= plan_t::KEPT;
       }},
      {"proofs exchanged",
       [](Wire* w, Random& g) {
         proof_t &a = AnyProof(w, g), &b = AnyProof(w, g);
         std::swap(a.separations, b.separations);
         return a.of == b.of && IsBroken(*w);
       }},
      {"plan moved",
       [](Wire* w, Random& g) {
         auto& x = w->plan.position.coefficients;
         Move(&x[3 * (g() % (x.size() / 3))], Uniform(g, 0.01, 3.0) * Somewhere(g));
         return IsBroken(*w);
       }},
      {"plan begins later",
       [](Wire* w, Random& g) {
         w->plan.utime += g() % 2 ? 1 : -1;
         return true;
       }},
      {"stop moved",
       [](Wire* w, Random& g) {
         Move(w->plan.stop.coefficients.data(), Uniform(g, 0.001, 1.0) * Somewhere(g));
         return true;
       }},
      {"stop exchanged",
       [](Wire* w, Random& g) {
         const Wire& other = Wires()[g() % Wires().size()];
         w->plan.stop = other.plan.stop;
         w->plan.stop_proofs = other.plan.stop_proofs;
         return other.seed != w->seed;
       }},
      {"stop at another time",
       [](Wire* w, Random& g) {
         w->plan.stop.utime = w->plan.utime - 2 - static_cast<int64_t>(g() % 100'000);
         return true;
       }},
      {"stop too fast",
       [](Wire* w, Random& g) {
         const auto stop = bus::FromMessage(w->plan.stop, w->plan.utime);
         for (int a = 3; a < 6; ++a) w->plan.stop.coefficients[static_cast<size_t>(a)] *= 1.5;
         return stop.Velocity(stop.start).norm() > 0.1 + 0.0 * Uniform(g, 0, 1);
       }},
      {"stop with a kink",
       [](Wire* w, Random& g) {
         const Vector3d speed = Uniform(g, 0.01, 0.1) * Somewhere(g);
         const double powers[] = {1.0, -3.0, 3.0, -1.0};  // tau (1 - tau)^3
         for (size_t k = 0; k < 4; ++k)
           Move(&w->plan.stop.coefficients[3 * k + 3], powers[k] * speed);
         return true;
       }},
      {"stop without rest",
       [](Wire* w, Random& g) {
         const Vector3d speed = Uniform(g, 0.1, 0.3) * Somewhere(g);
         Move(&w->plan.stop.coefficients[12], speed);
         Move(&w->plan.stop.coefficients[9], -speed);
         return true;
       }},
      {"proof from later on",
       [](Wire* w, Random& g) {
         proof_t& proof = AnyProof(w, g);
         proof.from = Uniform(g, 1e-6, 1.0);
         return proof.of == proof_t::SAFETY && w->plan.verdict < plan_t::BRAKE;
       }},
      {"not certified",
       [](Wire* w, Random& /*g*/) {
         w->plan.certified_clearance = -1.0;
         return true;
       }},
      {"not a number", [](Wire* w, Random& g) {
         double* places[] = {&w->plan.position.coefficients[4],
                             &w->plan.position.duration,
                             &AnyPlane(w, g).normal[1],
                             &AnyProof(w, g).radius,
                             &AnyObstacle(w, g).shape[0],
                             &AnyObstacle(w, g).center.duration,
                             &w->plan.hard_radius,
                             &w->forecast.covariance[0]};
         const size_t i = g() % 8;
         *places[i] = std::nan("");
         return i != 4 && i != 5;  // nobody asks a cylinder for its ellipsoid
       }}};
  return all;
}

TEST(Verify, TakesThePlannersOwnPlans) {
  ASSERT_GE(Wires().size(), 20u);
  size_t chases = 0, bodies = 0;
  for (const Wire& w : Wires()) {
    EXPECT_EQ(Fault(w), "") << "seed " << w.seed;
    EXPECT_FALSE(IsBroken(w)) << "seed " << w.seed;
    chases += w.plan.verdict <= plan_t::KEPT;
    for (const proof_t& p : w.plan.proofs) bodies += p.obstacle == kTarget;
  }
  EXPECT_GE(chases, 10u);
  EXPECT_EQ(bodies, Wires().size());
}

TEST(Verify, RefusesForgeriesOfEveryKind) {
  constexpr int kEach = 40;
  int made = 0, taken = 0;
  for (const auto& [name, forge] : Forgeries()) {
    Random g(7);
    int n = 0;
    for (int i = 0; n < kEach && i < 100 * kEach; ++i) {
      Wire w = Wires()[g() % Wires().size()];
      if (!forge(&w, g)) continue;
      ++n;
      if (!Fault(w).empty()) continue;
      ++taken;
      ADD_FAILURE() << name << ", try " << i << ", seed of the plan " << w.seed;
    }
    EXPECT_EQ(n, kEach) << name;
    made += n;
  }
  std::printf("%d forgeries of %zu kinds, %d taken\n", made, Forgeries().size(), taken);
}

std::string Refuted(const Wire& w) {
  std::vector<world::Obstacle> obstacles;
  for (const obstacle_t& o : w.list.obstacles)
    obstacles.push_back(bus::FromMessage(o, w.plan.utime));
  return world::Refute(bus::ClaimOf(w.plan, w.plan.utime), {kRadius, kSigmas, false}, obstacles);
}

// About radii near the greatest that control takes, of any proof that both look at. This check
// bounds less coarsely: what it alone takes is true.
TEST(Verify, AgreesWithTheCheckThatControlFliesBy) {
  Random g(3);
  int both = 0, neither = 0, ours = 0;
  for (int i = 0; i < 300; ++i) {
    Wire w = Wires()[g() % Wires().size()];
    w.plan.verdict = plan_t::SAFE_ONLY;
    w.plan.certified_clearance = 0.0;
    w.forecast.verdict = prediction_t::NO_TARGET;  // control leaves its body out
    proof_t* proof = &AnyProof(&w, g);
    while (proof->obstacle == kTarget) proof = &AnyProof(&w, g);
    double low = proof->radius, high = 30.0;
    while (high - low > 1e-9) {
      proof->radius = 0.5 * (low + high);
      (Refuted(w).empty() ? low : high) = proof->radius;
    }
    proof->radius = low + (g() % 2 ? 1.0 : -1.0) * std::pow(10.0, Uniform(g, -8.0, 0.3));
    proof->radius = std::max(proof->radius, w.plan.hard_radius);
    const bool taken = Fault(w).empty(), flown = Refuted(w).empty();
    both += taken && flown;
    neither += !taken && !flown;
    ours += taken && !flown;
    EXPECT_FALSE(!taken && flown) << i << ": " << Fault(w);
    EXPECT_FALSE(taken && !flown && IsBroken(w)) << i << ": " << Refuted(w);
  }
  std::printf("taken by both %d, by neither %d, by this alone %d\n", both, neither, ours);
  EXPECT_GE(both, 100);
  EXPECT_GE(neither, 50);
}

/// From (x, 0, 0) by `by`, from rest to rest in 2 s; off the solid of half size 1 about the origin
/// along n, from tau on.
Wire Escape(int8_t solid, double x, const Vector3d& by, const Vector3d& n, double tau) {
  Wire w;
  w.plan.verdict = plan_t::ESCAPE;
  w.plan.hard_radius = kRadius, w.plan.sigmas = kSigmas;
  Eigen::Matrix<double, Eigen::Dynamic, 3> c = Eigen::MatrixXd::Zero(6, 3);
  c(0, 0) = x;
  c.row(3) = 10.0 * by.transpose(), c.row(4) = -15.0 * by.transpose();
  c.row(5) = 6.0 * by.transpose();
  w.plan.position = bus::ToMessage({0.0, 2.0, c}, 0);
  w.plan.target = bus::ToMessage(world::Trajectory::Constant({9, 9, 9}, 0.0, 2.0), 0);
  proof_t proof{};
  proof.from = tau;
  proof.radius = kRadius;
  proof.separations = {{tau, 1.0, {n.x(), n.y(), n.z()}}};
  w.plan.proofs = {proof};
  world::Obstacle o;
  o.solid = static_cast<world::Obstacle::Solid>(solid);
  o.half = Vector3d::Ones();
  w.list.obstacles = {bus::ToMessage(o, 0)};
  w.forecast.verdict = prediction_t::NO_TARGET;
  return w;
}

TEST(Verify, AnEscapeLeavesByTheShortestWayAndSoon) {
  const Vector3d X = Vector3d::UnitX(), Z = Vector3d::UnitZ();
  const std::string back = "obstacle 0 is not left by the shortest way";
  const std::string later = "obstacle 0 is kept off only later";
  for (const int8_t solid : {obstacle_t::ELLIPSOID, obstacle_t::BOX, obstacle_t::CYLINDER})
    for (const double x : {1.2, 0.95}) {  // near it and inside
      EXPECT_EQ(Fault(Escape(solid, x, 5.0 * X, X, 0.25)), "") << int{solid} << x;
      EXPECT_EQ(Fault(Escape(solid, x, 14.0 * Z - 0.1 * X, Z, 0.25)), back) << int{solid} << x;
      EXPECT_EQ(Fault(Escape(solid, x, 5.0 * X, X, 0.26)), later);
      Wire w = Escape(solid, x, 5.0 * X, X, 0.25);
      w.plan.verdict = plan_t::SAFE_ONLY;
      EXPECT_EQ(Fault(w), later);
    }
  for (const double tau : {0.25, 0.6}) {
    Wire w = Escape(obstacle_t::BOX, 0.2, 14.0 * Z, Z, tau);
    w.list.obstacles[0].kind = obstacle_t::GROUND;
    EXPECT_EQ(Fault(w), "");
    w = Escape(obstacle_t::BOX, 0.9, 5.0 * X - 0.1 * Z, X, tau);
    w.list.obstacles[0].kind = obstacle_t::GROUND;
    EXPECT_EQ(Fault(w), back) << "the ground is left by its top";
  }
}

TEST(Verify, CountsWhatItCannotVerify) {
  Wire w = Wires().front();
  const auto bodies = [](const std::vector<proof_t>& proofs) {
    return std::count_if(proofs.begin(), proofs.end(),
                         [](const proof_t& p) { return p.obstacle == kTarget; });
  };
  const Grounds grounds{&w.list, nullptr, kRadius, kSigmas};
  EXPECT_EQ(Examine(w.plan, grounds).fault, "");
  EXPECT_EQ(Examine(w.plan, grounds).unverified,
            bodies(w.plan.proofs) + bodies(w.plan.stop_proofs));
  w.plan.proofs.push_back(w.plan.proofs.front());
  w.plan.proofs.back().obstacle = 4711;
  EXPECT_EQ(Examine(w.plan, {&w.list, &w.forecast, kRadius, kSigmas}).unverified, 1);
}

}  // namespace
}  // namespace chase::logs
