// Speed of the separating planes: 50 bodies (ellipsoids, boxes, upright cylinders; half of them
// with an uncertainty that grows) near one chase of degree 6, safety and sight in one certificate,
// three intervals a body. Counters:
//   intervals   of the whole plan
//   ratio       time of the exact check over time of the check in double, both in this run

#include <benchmark/benchmark.h>

#include <chrono>
#include <vector>

#include "common/world/separation.h"
#include "test/unit/separation_pairs.h"

namespace chase::world {
namespace {

constexpr int kBodies = 50;

struct Plan {
  Ball drone, target;
  std::vector<Body> bodies;
  std::vector<Certificate> certificates;
  int intervals = 0;
};

/// Proofs of the thirds of the horizon, one after the other; empty where there is none.
Certificate InThirds(const Plan& plan, const Body& body) {
  Certificate all;
  for (int i = 0; i < 3; ++i) {
    const SeparationResult third =
        Separate(plan.drone, &plan.target, body, i / 3.0, i == 2 ? 1.0 : (i + 1) / 3.0);
    if (third.kept != Kept::kOff) return {};
    for (const Separation& s : third.certificate) all.push_back(s);
  }
  return all;
}

Plan MakePlan() {
  Random random(1);
  SeparationPair pair = RandomPair(&random);
  Plan plan{pair.drone, pair.target, {}, {}, 0};
  while (plan.bodies.size() < kBodies) {
    const Body body = RandomBody(&random, RandomPlace(&random, pair));
    const Certificate certificate = InThirds(plan, body);
    if (certificate.size() != 3) continue;
    plan.bodies.push_back(body);
    plan.certificates.push_back(certificate);
    plan.intervals += 3;
  }
  return plan;
}

template <class Check>
bool All(const Plan& plan, Check check) {
  bool all = true;
  for (size_t i = 0; i < plan.bodies.size(); ++i)
    all = check(plan.certificates[i], plan.drone, &plan.target, plan.bodies[i]) && all;
  return all;
}

template <class Check>
double Seconds(const Plan& plan, Check check, int repeats) {
  const auto start = std::chrono::steady_clock::now();
  for (int i = 0; i < repeats; ++i) benchmark::DoNotOptimize(All(plan, check));
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / repeats;
}

void CheckPlan(benchmark::State& state) {
  const Plan plan = MakePlan();
  if (!All(plan, Certifies) || !All(plan, CertifiesExactly))
    state.SkipWithError("a certificate is refused");
  for (auto _ : state) benchmark::DoNotOptimize(All(plan, Certifies));
  state.counters["intervals"] = plan.intervals;
  state.counters["ratio"] = Seconds(plan, CertifiesExactly, 20) / Seconds(plan, Certifies, 2000);
}
BENCHMARK(CheckPlan)->Unit(benchmark::kMicrosecond);

void CheckPlanExactly(benchmark::State& state) {
  const Plan plan = MakePlan();
  for (auto _ : state) benchmark::DoNotOptimize(All(plan, CertifiesExactly));
  state.counters["intervals"] = plan.intervals;
}
BENCHMARK(CheckPlanExactly)->Unit(benchmark::kMicrosecond);

void ProvePlan(benchmark::State& state) {
  const Plan plan = MakePlan();
  size_t intervals = 0;
  for (auto _ : state) {
    intervals = 0;
    for (const Body& body : plan.bodies)
      intervals += Separate(plan.drone, &plan.target, body).certificate.size();
  }
  state.counters["intervals"] = static_cast<double>(intervals);
}
BENCHMARK(ProvePlan)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace chase::world
