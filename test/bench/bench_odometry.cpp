#include <benchmark/benchmark.h>

#include <algorithm>
#include <ctime>

#include "common/math/rotation.h"
#include "test/bench/odometry_pcl_rival.h"
#include "test/unit/odometry_ceres.h"
#include "test/unit/odometry_course.h"
#include "test/unit/odometry_kitti.h"

namespace chase::odometry {
namespace {

constexpr int kRivalSweeps = 5;
constexpr double kRivalVoxel = 0.5;  // m

double CpuMilliseconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

double Quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0.0;
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(q * static_cast<double>(values.size() - 1))];
}

std::vector<Eigen::Vector3f> PointsOf(const Sweep& sweep) {
  std::vector<Eigen::Vector3f> points;
  for (const auto& point : sweep.points) points.push_back(point.p);
  return points;
}

/// Median CPU time of PCL's generalised ICP from one sweep to the next [ms].
double RivalMilliseconds(const std::vector<Sweep>& sweeps) {
  std::vector<double> spent;
  for (size_t i = 10; i < 10 + kRivalSweeps && i + 1 < sweeps.size(); ++i) {
    const auto source = PointsOf(sweeps[i + 1]), target = PointsOf(sweeps[i]);
    const double start = CpuMilliseconds();
    benchmark::DoNotOptimize(
        rival::MatchWithGicp(source, target, kRivalVoxel, Eigen::Isometry3d::Identity()));
    spent.push_back(CpuMilliseconds() - start);
  }
  return Quantile(spent, 0.5);
}

void Kitti(benchmark::State& state) {
  const std::vector<Sweep> sweeps = test::LoadKittiSweeps({});
  if (sweeps.empty()) {
    state.SkipWithError("skipped: real recordings not present");
    return;
  }
  std::vector<Pose> estimate;
  std::vector<double> spent;
  for (auto _ : state) {
    Odometry odometry(OdometryConfig{});
    estimate.clear();
    spent.clear();
    for (const Sweep& sweep : sweeps) {
      const double start = CpuMilliseconds();
      odometry.AddSweep(sweep);
      while (odometry.SweepReady())
        if (const SweepResult result = odometry.ProcessSweep(); result.pose)
          estimate.push_back(result.pose->X_WB);
      spent.push_back(CpuMilliseconds() - start);
    }
  }
  const auto errors = test::ErrorsFromFirstPose(estimate, test::LoadKittiReference());
  state.counters["rmse_m"] = test::RootMeanSquare(errors);
  state.counters["end_m"] = errors.back();
  state.counters["median_ms"] = Quantile(spent, 0.5);
  state.counters["p99_ms"] = Quantile(spent, 0.99);
  state.counters["gicp_ms"] = RivalMilliseconds(sweeps);
  state.counters["ratio_to_gicp"] =
      state.counters["median_ms"].value / state.counters["gicp_ms"].value;
}
BENCHMARK(Kitti)->Name("kitti")->Iterations(1)->Unit(benchmark::kMillisecond);

void Course(benchmark::State& state, const test::Flight& flight, double duration) {
  test::Course course;
  course.flight = flight;
  course.duration = duration;
  course.seed = static_cast<unsigned>(state.range(0));
  test::CourseResult result;
  for (auto _ : state) result = test::Fly(course, test::ConfigFor(flight));
  state.counters["rmse_m"] = result.PositionRms();
  state.counters["velocity_rms"] = result.VelocityRms();
  state.counters["worst_m"] = result.WorstPosition();
  state.counters["end_z_m"] = std::abs(result.visits.back().estimate.X_WB.p.z() -
                                       flight.X_WB(result.visits.back().estimate.t).p.z());
  state.counters["mean_ms"] = result.sweep_cpu_ms;
  state.counters["max_ms"] = result.worst_sweep_ms;
}
BENCHMARK_CAPTURE(Course, gym, test::Flight{}, 60.0)
    ->Name("synthetic_gym")
    ->DenseRange(1, 3)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Course, aggressive, test::Flight::Aggressive(), 30.0)
    ->Name("synthetic_aggressive")
    ->Arg(1)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(Course, rest, test::Flight::AtRest(), 60.0)
    ->Name("synthetic_rest")
    ->Arg(1)
    ->Iterations(1)
    ->Unit(benchmark::kMillisecond);

/// A map and a sweep of the hall for the solvers.
struct Problem {
  SurfaceMap planes{MapConfig{}, SurfaceKind::kPlane}, posts{MapConfig{}, SurfaceKind::kLine};
  Features features;
  Pose start{math::FromYaw(0.01), {0.03, -0.03, 1.02}};

  Problem() {
    test::Noise noise(1);
    const Pose at{Eigen::Quaterniond::Identity(), {0.0, 0.0, 1.0}};
    const Sweep sweep = test::Scan(
        test::Hall{}, [&](double) { return at; }, 0.0, test::SensorModel{}, &noise);
    const FeatureSet set = ExtractFeatures(FeatureConfig{}, sweep.points);
    for (size_t i = 0; i < set.planes.size(); ++i) {
      const auto& p = sweep.points[static_cast<size_t>(set.planes[i])].p;
      planes.Add({p + at.p.cast<float>()}, at.p.cast<float>());
      if (i % 10 == 0) features.planes.push_back(p);
    }
  }
};

void GaussNewton(benchmark::State& state) {
  const Problem problem;
  const ScanMatcher matcher(MatchConfig{});
  for (auto _ : state)
    benchmark::DoNotOptimize(matcher.Match(problem.features, problem.planes, problem.posts,
                                           problem.start, 5e-5 * Matrix6d::Identity()));
}
BENCHMARK(GaussNewton)->Name("solver/gauss_newton")->Unit(benchmark::kMillisecond);

void Ceres(benchmark::State& state) {
  const Problem problem;
  for (auto _ : state)
    benchmark::DoNotOptimize(
        test::MatchWithCeres(problem.features.planes, problem.planes, problem.start, 0.1));
}
BENCHMARK(Ceres)->Name("solver/ceres")->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace chase::odometry
