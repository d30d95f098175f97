#include "services/prediction/predictor.h"

#include <algorithm>
#include <cmath>

#include "services/prediction/branch_search.h"
#include "services/prediction/candidate_set.h"
#include "services/prediction/clearance.h"
#include "services/prediction/table_search.h"

namespace chase::prediction {
namespace {

constexpr double kFreeShares[] = {0.7, 0.4, 0.0};
constexpr size_t kMaxObservations = 32;

bool IsUsable(const Observation& o, double now) {
  return std::isfinite(o.t) && o.t <= now && o.mean.allFinite() && o.covariance.allFinite();
}

std::vector<Observation> UsableObservations(const PredictRequest& request) {
  std::vector<Observation> usable;
  for (const Observation& o : request.observations)
    if (IsUsable(o, request.now)) usable.push_back(o);
  std::stable_sort(usable.begin(), usable.end(),
                   [](const Observation& a, const Observation& b) { return a.t < b.t; });
  if (usable.size() > kMaxObservations)
    usable.erase(usable.begin(), usable.end() - static_cast<ptrdiff_t>(kMaxObservations));
  return usable;
}

std::vector<HorizonObstacle> Shrunk(std::vector<HorizonObstacle> obstacles, double share) {
  if (share <= 0.0) return {};
  for (HorizonObstacle& obstacle : obstacles) obstacle = Scaled(obstacle, share);
  return obstacles;
}

// Chooses the search by the size of the set; the table is built once for all runs, when needed.
class Searcher {
 public:
  Searcher(const PredictorConfig& config, const CandidateSet& candidates)
      : config_(config), candidates_(candidates) {}

  SearchResult Run(const std::vector<HorizonObstacle>& obstacles) {
    if (candidates_.IsMiddleCheapest() && IsMiddleClear(obstacles)) return Middle();
    if (candidates_.count() > config_.table_limit)
      return BranchSearch(candidates_, obstacles, config_.node_limit);
    if (table_.empty()) table_.emplace_back(candidates_);
    return table_.front().Run(obstacles, config_.visit_limit);
  }

 private:
  bool IsMiddleClear(const std::vector<HorizonObstacle>& obstacles) const {
    int hit = -1;
    return IsClear(candidates_.mean_fit(), obstacles, &hit);
  }
  SearchResult Middle() const {
    SearchResult result;
    result.choice = Choice(static_cast<size_t>(candidates_.steps()), 0);
    result.cost = candidates_.Cost(Eigen::VectorXd::Zero(candidates_.dims()));
    result.lower_bound = result.cost;
    result.checked = 1;
    return result;
  }

  const PredictorConfig& config_;
  const CandidateSet& candidates_;
  std::vector<TableSearch> table_;
};

void SetOutcome(const CandidateSet& candidates, const SearchResult& found, double now,
                PredictResult* result) {
  result->trajectory = {now, candidates.horizon(),
                        candidates.CoefficientsOf(candidates.Delta(found.choice))};
  result->cost = found.cost;
  result->gap = found.complete ? 0.0 : std::clamp(1.0 - found.lower_bound / found.cost, 0.0, 1.0);
}

void SearchAndRelax(const PredictorConfig& config, const CandidateSet& candidates,
                    const std::vector<HorizonObstacle>& obstacles, double now,
                    PredictResult* result) {
  Searcher searcher(config, candidates);
  SearchResult found = searcher.Run(obstacles);
  result->checked = found.checked;
  result->nodes = found.nodes;
  result->verdict =
      found.found() ? PredictResult::Verdict::kOk : PredictResult::Verdict::kColliding;
  if (!found.found())
    result->reason = found.complete ? "every candidate meets an obstacle"
                                    : "no clear candidate within the node limit";
  for (size_t i = 0; !found.found() && i < std::size(kFreeShares); ++i) {
    result->free_share = kFreeShares[i];
    found = searcher.Run(Shrunk(obstacles, kFreeShares[i]));
    result->checked += found.checked;
    result->nodes += found.nodes;
  }
  SetOutcome(candidates, found, now, result);
}

// `planar` holds the height. Its variances: the squared departure of a line through the observed
// heights from the held one, and the line's own, whose rate is 0 by all that is known before, with
// the variance of the other axes. Errors of the observations are taken as independent.
void SetHeightVariances(const std::vector<Observation>& observations, double now, double floor,
                        PredictResult* result) {
  double n = 0.0, t = 0.0, z = 0.0, tt = 0.0, tz = 0.0;  // sums, weighted by 1/m^2
  for (const Observation& o : observations) {
    const double w = 1.0 / std::max(o.covariance(2, 2), floor * floor), at = o.t - now;
    n += w, t += w * at, z += w * o.mean.z(), tt += w * at * at, tz += w * at * o.mean.z();
  }
  Eigen::Matrix3d &p = result->position_covariance, &v = result->velocity_covariance;
  const double variance = 1.0 / (tt - t * t / n + 1.0 / std::max(v(2, 2), 1e-9));
  const double rate = variance * (tz - t * z / n), height = (z - rate * t) / n;
  const double off = height - result->trajectory.Position(now).z();
  for (Eigen::Matrix3d* m : {&p, &v}) m->row(2).setZero(), m->col(2).setZero();
  p(2, 2) = off * off + 1.0 / n + t * t / (n * n) * variance;
  v(2, 2) = rate * rate + variance;
}

}  // namespace

PredictResult Predictor::Predict(const PredictRequest& request) const {
  PredictResult result;
  const std::vector<Observation> observations = UsableObservations(request);
  if (!std::isfinite(request.now) || observations.size() < 2) {
    result.reason = "fewer than 2 observations";
    return result;
  }
  const CandidateSet candidates(config_, observations, request.now);
  if (!candidates.mean_fit().allFinite()) {
    result.reason = "the observations are too far apart for numbers to hold";
    return result;
  }
  const auto obstacles = PrepareObstacles(request.obstacles, observations, candidates, request.now,
                                          config_.inflation * request.target_radius, config_);
  result.candidates = candidates.count();
  result.obstacles = static_cast<int>(obstacles.size());
  result.position_covariance = candidates.PositionCovariance();
  result.velocity_covariance = candidates.VelocityCovariance();
  SearchAndRelax(config_, candidates, obstacles, request.now, &result);
  if (config_.planar) SetHeightVariances(observations, request.now, config_.sigma_floor, &result);
  return result;
}

bool StaysClear(const PredictorConfig& config, const PredictRequest& request,
                const world::Trajectory& trajectory) {
  const double left = trajectory.end() - request.now;
  if (!(left > 0.0)) return true;
  PredictorConfig rest = config;
  rest.horizon = left;
  const std::vector<Observation> observations = UsableObservations(request);
  if (observations.empty()) return true;
  const CandidateSet candidates(rest, observations, request.now);
  const auto obstacles = PrepareObstacles(request.obstacles, observations, candidates, request.now,
                                          config.inflation * request.target_radius, rest);
  int hit = -1;
  return IsClear(trajectory.Reparametrised(request.now, left).coefficients, obstacles, &hit);
}

}  // namespace chase::prediction
