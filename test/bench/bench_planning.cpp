// Speed of the planner against its own references. Every row plans seeded instances: full 3x3
// shapes, every other obstacle moving, all costs on. A plan, from the request to the proven winner,
// is timed by the processor time of this process, median of `repeats` runs. Counters:
//   p50_us p99_us max_us   over the instances
//   ratio                  p50 of the double-Sturm reference over p50 of ours, both on the first
//                          `reference_instances` instances; the reference tests the paper's sight
//                          condition, also where ours tests the exact one
//   same_winner            share of the first `compared` instances with the winner of testing every
//                          candidate with the certificate
//   same_as_double         share of the reference's instances with its winner
//   feasible_share         of the candidates, on the compared instances

#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <vector>

#include "services/planning/fast_problem.h"
#include "services/planning/fast_search.h"
#include "services/planning/reference_search.h"
#include "services/planning/refinement.h"
#include "services/planning/skeletons.h"
#include "test/bench/literal_planner.h"
#include "test/unit/planning_instances.h"

namespace chase::planning {
namespace {

constexpr int kInstances = 500, kReferenceInstances = 60;

double CpuMicroseconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return 1e6 * static_cast<double>(t.tv_sec) + 1e-3 * static_cast<double>(t.tv_nsec);
}

double Quantile(std::vector<double> v, double share) {
  if (v.empty()) return 0.0;
  std::sort(v.begin(), v.end());
  return v[std::min(v.size() - 1, static_cast<size_t>(share * static_cast<double>(v.size())))];
}

template <class F>
double MedianMicroseconds(int repeats, F&& run) {
  std::vector<double> times;
  for (int i = 0; i < repeats; ++i) {
    const double before = CpuMicroseconds();
    run();
    times.push_back(CpuMicroseconds() - before);
  }
  return Quantile(times, 0.5);
}

PlannerConfig Config(int steps, int skeletons, bool exact) {
  PlannerConfig c = PlannerConfig::Literal();
  c.steps = steps;
  c.skeletons = skeletons;
  c.exact_visibility = exact;
  return c;
}

InstanceSpec Spec(int n_obstacles, bool hard) {
  InstanceSpec s;
  s.n_obstacles = n_obstacles;
  if (hard) s.feasible_low = 0.0, s.feasible_high = 0.06, s.extent = 2.0;
  return s;
}

/// From a request to the best candidate, as the planner goes about it.
class Searcher {
 public:
  Searcher(const PlannerConfig& config, std::unique_ptr<Search> search)
      : config_(config), search_(std::move(search)), placer_(config), shelf_(config) {}
  explicit Searcher(const PlannerConfig& config) : Searcher(config, MakeFastSearch(config)) {}

  Found operator()(const PlanRequest& request) {
    const Problem problem = Pose(request);
    proof_.Reset(problem, 0.0, config_.exact_visibility);
    return search_->Best(problem, 0.0, HUGE_VAL, &proof_);
  }
  Problem Pose(const PlanRequest& request) {
    Problem problem = MakeProblem(config_, request, nullptr);
    placer_.Place(Layout::kNormal, &problem);
    LimitToReach(config_, shelf_.Get(problem.degree, config_.steps, problem.duration),
                 Refiner::kReach, &problem);
    return problem;
  }

 private:
  PlannerConfig config_;
  std::unique_ptr<Search> search_;
  SkeletonPlacer placer_;
  TableShelf shelf_;
  PlanProof proof_;
};

void Count(benchmark::State& state, const std::vector<double>& us) {
  state.counters["p50_us"] = Quantile(us, 0.5);
  state.counters["p99_us"] = Quantile(us, 0.99);
  state.counters["max_us"] = Quantile(us, 1.0);
  state.counters["instances"] = static_cast<double>(us.size());
}

void CountReference(benchmark::State& state, const std::vector<double>& reference_us,
                    const std::vector<double>& us) {
  state.counters["ratio"] = Quantile(reference_us, 0.5) / Quantile(us, 0.5);
  state.counters["reference_p50_us"] = Quantile(reference_us, 0.5);
  state.counters["reference_instances"] = static_cast<double>(us.size());
}

struct Size {
  int steps, skeletons, obstacles;
  bool hard;
  int reference, compared, repeats;
};

void Plan(benchmark::State& state, const Size& size) {
  const PlannerConfig config = Config(size.steps, size.skeletons, false);
  const InstanceGenerator generator(config, Spec(size.obstacles, size.hard));
  Searcher fast(config), reference(config, MakeReferenceSearch(config, Arithmetic::kDoubleSturm)),
      all(config, MakeReferenceSearch(config, Arithmetic::kCertified));
  std::vector<double> us, subset, reference_us;
  int same = 0, same_as_double = 0;
  double feasible = 0.0;
  for (auto _ : state) {
    for (int i = 0; i < kInstances; ++i) {
      const PlanRequest request = generator.Make(1000u + static_cast<unsigned>(i));
      Found found;
      us.push_back(MedianMicroseconds(size.repeats, [&] { found = fast(request); }));
      if (i < size.compared) {
        const Found expected = all(request);
        same += found.index == expected.index;
        feasible += static_cast<double>(expected.feasible) / expected.generated;
      }
      if (i >= size.reference) continue;
      Found expected;
      reference_us.push_back(MedianMicroseconds(1, [&] { expected = reference(request); }));
      subset.push_back(us.back());
      same_as_double += found.index == expected.index;
    }
  }
  Count(state, us);
  CountReference(state, reference_us, subset);
  state.counters["same_winner"] = static_cast<double>(same) / size.compared;
  state.counters["same_as_double"] = static_cast<double>(same_as_double) / size.reference;
  state.counters["compared"] = size.compared;
  state.counters["feasible_share"] = feasible / size.compared;
  state.counters["repeats"] = size.repeats;
}

/// Is the reference as fast as plain code that shares nothing with it? By turns on one problem.
void Literal(benchmark::State& state) {
  const PlannerConfig config = Config(3, 12, false);
  const InstanceGenerator generator(config, Spec(50, false));
  Searcher poser(config);
  const auto reference = MakeReferenceSearch(config, Arithmetic::kDoubleSturm);
  std::vector<double> us, literal_us;
  int same = 0, same_feasible = 0;
  for (auto _ : state) {
    for (int i = 0; i < kReferenceInstances; ++i) {
      const Problem problem = poser.Pose(generator.Make(1000u + static_cast<unsigned>(i)));
      Found found;
      LiteralPlan literal;
      us.push_back(MedianMicroseconds(1, [&] { found = reference->Best(problem, 0.0, false); }));
      literal_us.push_back(
          MedianMicroseconds(1, [&] { literal = PlanLiterally(config, problem); }));
      same += found.index == literal.index;
      same_feasible += found.feasible == literal.feasible;
    }
  }
  Count(state, us);
  state.counters["literal_p50_us"] = Quantile(literal_us, 0.5);
  state.counters["over_literal"] = Quantile(us, 0.5) / Quantile(literal_us, 0.5);
  state.counters["same_winner"] = same / static_cast<double>(kReferenceInstances);
  state.counters["same_feasible"] = same_feasible / static_cast<double>(kReferenceInstances);
}

/// Exact visibility against the paper's bound on the same instances.
void ExactVisibility(benchmark::State& state, bool hard) {
  const PlannerConfig bound = Config(3, 12, false), exact = Config(3, 12, true);
  const InstanceGenerator generator(bound, Spec(50, hard));
  Searcher with_bound(bound), with_exact(exact),
      reference(bound, MakeReferenceSearch(bound, Arithmetic::kDoubleSturm));
  std::vector<double> bound_us, us, subset, reference_us;
  int better = 0, worse = 0;
  for (auto _ : state) {
    for (int i = 0; i < kInstances; ++i) {
      const PlanRequest request = generator.Make(1000u + static_cast<unsigned>(i));
      Found a, b;
      bound_us.push_back(MedianMicroseconds(5, [&] { a = with_bound(request); }));
      us.push_back(MedianMicroseconds(5, [&] { b = with_exact(request); }));
      const double cost_a = a.index < 0 ? HUGE_VAL : a.cost.total;
      const double cost_b = b.index < 0 ? HUGE_VAL : b.cost.total;
      better += cost_b < cost_a;
      worse += cost_b > cost_a;
      if (i >= kReferenceInstances) continue;
      subset.push_back(us.back());
      reference_us.push_back(MedianMicroseconds(1, [&] { reference(request); }));
    }
  }
  Count(state, us);
  CountReference(state, reference_us, subset);
  state.counters["time_ratio"] = Quantile(us, 0.5) / Quantile(bound_us, 0.5);
  state.counters["better_share"] = static_cast<double>(better) / kInstances;
  state.counters["worse"] = worse;
}

/// Plans proven in the Minkowski sum, with covariances that grow, and each with a certified stop,
/// beside the search alone among ellipsoids. Instances without such a plan are left out.
void Certified(benchmark::State& state) {
  constexpr int kRepeats = 15;  // that another process's burst does not last for most of them
  const PlannerConfig exact = Config(3, 12, true);
  PlannerConfig config = exact;
  config.minkowski_sums = true;
  config.sigmas = 2.0;
  const InstanceGenerator generator(Config(3, 12, false), Spec(50, false));
  Searcher search(exact);
  const auto planner = MakePlanner("chase", config);
  std::vector<double> us, search_us;
  for (auto _ : state) {
    for (int i = 0; i < kInstances; ++i) {
      PlanRequest request = generator.Make(1000u + static_cast<unsigned>(i));
      const double search_one = MedianMicroseconds(kRepeats, [&] { search(request); });
      for (world::Obstacle& o : request.obstacles) {
        o.position_covariance.diagonal().setConstant(4e-4);  // m^2
        o.velocity_covariance.diagonal().setConstant(1e-4);  // m^2/s^2
      }
      PlanResult plan;
      const double one = MedianMicroseconds(kRepeats, [&] { plan = planner->Plan(request); });
      if (plan.verdict != Verdict::kChase || !plan.stop) continue;
      us.push_back(one);
      search_us.push_back(search_one);
    }
  }
  Count(state, us);
  state.counters["time_ratio"] = Quantile(us, 0.5) / Quantile(search_us, 0.5);
}

/// Feasibility of all candidates, none left out: the kernels' tables are made, then everything is
/// tested.
void CheckAll(benchmark::State& state) {
  const PlannerConfig config = Config(3, 12, true);
  const InstanceGenerator generator(Config(3, 12, false), Spec(50, false));
  Searcher searcher(config);
  PlanProof proof;
  FastProblem fast(config, kernels::Kernels());
  std::vector<double> us;
  double candidates = 0.0;
  for (auto _ : state) {
    for (int i = 0; i < kInstances; ++i) {
      const PlanRequest request = generator.Make(1000u + static_cast<unsigned>(i));
      const Problem problem = searcher.Pose(request);
      proof.Reset(problem, 0.0, true);
      if (!fast.Set(problem, &proof) || !fast.SetObstacles()) continue;
      const int n = fast.n_candidates();
      std::vector<int> ids(static_cast<size_t>(n + kernels::kPad)), states(ids.size());
      us.push_back(MedianMicroseconds(5, [&] {
        for (int k = 0; k < n; ++k) ids[static_cast<size_t>(k)] = k;
        kernels::Kernels().check(fast.context(), ids.data(), states.data(), n);
      }));
      candidates += n;
    }
  }
  double total = 0.0;
  for (double t : us) total += t;
  Count(state, us);
  state.counters["candidates_per_s"] = 1e6 * candidates / total;
}

/// What refinement adds to a plan, and what it gains.
void Refinement(benchmark::State& state) {
  const PlannerConfig config = Config(3, 12, true);
  const InstanceGenerator generator(Config(3, 12, false), Spec(50, false));
  Searcher fast(config);
  Refiner refiner(config);
  std::vector<double> us, gain;
  int worse = 0;
  for (auto _ : state) {
    for (int i = 0; i < kInstances; ++i) {
      const PlanRequest request = generator.Make(1000u + static_cast<unsigned>(i));
      const Problem problem = fast.Pose(request);
      const Found found = fast(request);
      if (found.index < 0) continue;
      Curve plan;
      Cost cost;
      us.push_back(MedianMicroseconds(5, [&] {
        plan = found.plan;
        cost = found.cost;
        if (refiner.Reset(problem, 0.0) && !refiner.Improve(4, &plan, &cost)) cost = found.cost;
      }));
      worse += cost.total > found.cost.total;
      gain.push_back(1.0 - cost.total / found.cost.total);
    }
  }
  Count(state, us);
  state.counters["gain_median_percent"] = 100.0 * Quantile(gain, 0.5);
  state.counters["worse"] = worse;
}

double SearchP50(int steps, int skeletons, int n_obstacles) {
  const PlannerConfig config = Config(steps, skeletons, true);
  const InstanceGenerator generator(Config(3, 12, false), Spec(n_obstacles, false));
  Searcher fast(config);
  std::vector<double> us;
  for (unsigned i = 0; i < 100; ++i) {
    const PlanRequest request = generator.Make(3000u + i);
    us.push_back(MedianMicroseconds(3, [&] { fast(request); }));
  }
  return Quantile(us, 0.5);
}

/// Slope of log(time) over log(size), least squares.
double Exponent(const std::vector<double>& size, const std::vector<double>& time) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  const double n = static_cast<double>(size.size());
  for (size_t i = 0; i < size.size(); ++i) {
    const double x = std::log(size[i]), y = std::log(time[i]);
    sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  return (n * sxy - sx * sy) / (n * sxx - sx * sx);
}

void Growth(benchmark::State& state) {
  std::vector<double> n, n_us, o, o_us;
  for (auto _ : state) {
    for (int steps : {2, 3, 4, 5}) {  // 10^2 to 10^5 candidates
      n.push_back(std::pow(10.0, steps));
      n_us.push_back(SearchP50(steps, 10, 50));
      state.counters["us_10^" + std::to_string(steps)] = n_us.back();
    }
    for (int obstacles : {5, 16, 50, 160, 500}) {
      o.push_back(obstacles);
      o_us.push_back(SearchP50(3, 12, obstacles));
      state.counters["us_" + std::to_string(obstacles) + "_obstacles"] = o_us.back();
    }
  }
  state.counters["exponent_candidates"] = Exponent(n, n_us);
  state.counters["exponent_obstacles"] = Exponent(o, o_us);
}

const bool kRegistered = [] {
  const auto row = [](const char* name, auto&& f) {
    benchmark::RegisterBenchmark(name, f)->Iterations(1)->Unit(benchmark::kMillisecond);
  };
  row("exact_visibility/1728x50", [](benchmark::State& s) { ExactVisibility(s, false); });
  row("certified/1728x50", Certified);
  row("plan/1728x50", [](benchmark::State& s) {
    Plan(s, {3, 12, 50, false, kReferenceInstances, kInstances, 5});
  });
  row("plan/20736x50", [](benchmark::State& s) { Plan(s, {4, 12, 50, false, 6, 50, 3}); });
  row("plan/hard/1728x50", [](benchmark::State& s) {
    Plan(s, {3, 12, 50, true, kReferenceInstances, kInstances, 5});
  });
  row("exact_visibility/hard/1728x50", [](benchmark::State& s) { ExactVisibility(s, true); });
  row("literal/1728x50", Literal);
  row("check_all/1728x50", CheckAll);
  row("refinement/1728x50", Refinement);
  row("growth", Growth);
  return true;
}();

}  // namespace
}  // namespace chase::planning
