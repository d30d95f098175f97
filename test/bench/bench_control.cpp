// Control's check of a plan: 50 obstacles (ellipsoids, boxes, upright cylinders, half of them
// uncertain, half moving), safety and sight of the plan and safety of its stop, as the planner
// proves them. Counters: proofs and separating planes of the plan.

#include <benchmark/benchmark.h>

#include "test/unit/control_claims.h"

namespace chase::control {
namespace {

test::Case FirstCertified() {
  for (unsigned seed = 1;; ++seed)
    if (test::Case c = test::MakeCase(seed, 50); c.claim.certified && c.claim.stop) return c;
}

void CheckPlan(benchmark::State& state) {
  const test::Case c = FirstCertified();
  for (auto _ : state) {
    std::string bad = world::Refute(c.claim, c.least, c.obstacles);
    if (!bad.empty()) state.SkipWithError(bad.c_str());
    benchmark::DoNotOptimize(bad);
  }
  size_t planes = 0;
  for (const auto* proofs : {&c.claim.proofs, &c.claim.stop_proofs})
    for (const world::Proof& proof : *proofs) planes += proof.separations.size();
  state.counters["proofs"] =
      static_cast<double>(c.claim.proofs.size() + c.claim.stop_proofs.size());
  state.counters["planes"] = static_cast<double>(planes);
}
BENCHMARK(CheckPlan)->Unit(benchmark::kMicrosecond);

}  // namespace
}  // namespace chase::control
