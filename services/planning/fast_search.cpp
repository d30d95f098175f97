#include "services/planning/fast_search.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "services/planning/fast_problem.h"
#include "services/planning/limits.h"
#include "services/planning/reference_search.h"

namespace chase::planning {
namespace {

using kernels::kBatch;
using kernels::kPad;

// Candidates that the ellipsoids let pass and the proof does not, until the search gives up. With
// 256 the longest plan of a flight in an office took 88 ms, with 64 it took 11.
constexpr int kMostRefused = 64;
// Candidates at the edge of a shape that only sorts whose proof is asked and fails, until others of
// that kind are left for when there is nothing else: of 488 plans in bench_planning's `certified`
// one differs, by 1.7 % of its cost, and the 99th percentile of the least of five runs falls from
// 139 to 124 us. With 2 it is the same; with 0 eleven differ, one by 17 %. Chosen on these.
constexpr int kMostAtEdge = 4;
constexpr int kSorted = 4 * kBatch;  // candidates at a time
constexpr float kSlack = 1e-4f;      // relative: costs in single precision are that good

class FastSearch : public Search {
 public:
  FastSearch(const PlannerConfig& config, const kernels::Table& table)
      : config_(config),
        kernels_(table),
        fast_(config, table),
        fallback_(MakeReferenceSearch(config, Arithmetic::kCertified)) {}

  using Search::Best;
  Found Best(const Problem& problem, double sight_from, double bound, PlanProof* proof) override {
    proof_ = proof;
    // Single precision leaves out what J2 costs all alike.
    const double alike = config_.weight_obstacle * config_.cost_min * problem.duration *
                         static_cast<double>(problem.obstacles.size());
    if (!fast_.Set(problem, proof, static_cast<float>(1.001 * (bound - alike))))
      return fallback_->Best(problem, sight_from, bound, proof);
    problem_ = &problem;
    bound_ = static_cast<float>(bound - alike);
    Found found;
    found.generated = fast_.n_candidates();
    // First the winner alone is proven. Where that fails, or there is none and some were left, each
    // is before it becomes the bound.
    int winner = -1;
    for (const bool all : {false, true}) {
      proves_all_ = all;
      winner = Run();
      if (all || (winner < 0 ? !left_ : proof_->Holds(fast_.PlanOf(winner)))) break;
    }
    if (fast_.IsBeyondKernels()) return fallback_->Best(problem, sight_from, bound, proof);
    found.checked = checked_;
    found.feasible = feasible_;
    if (winner < 0) return found;
    found.index = winner;
    found.plan = fast_.PlanOf(winner);
    found.cost = winner_cost_;
    return found;
  }

 private:
  /// A candidate and its lower bound or cost, which is not negative: sorted as one number.
  struct Entry {
    uint64_t key;
    Entry() = default;
    Entry(float cost, int id) {
      uint32_t bits;
      std::memcpy(&bits, &cost, sizeof bits);
      key = uint64_t{bits} << 32 | static_cast<uint32_t>(id);
    }
    float cost() const {
      const auto bits = static_cast<uint32_t>(key >> 32);
      float cost;
      std::memcpy(&cost, &bits, sizeof cost);
      return cost;
    }
    int id() const { return static_cast<int>(key & 0xffffffff); }
    bool operator<(const Entry& e) const { return key < e.key; }
  };

  int Run();
  bool PruneAll();
  void Weigh(float low, float high);
  void WeighListed(int n);
  void SearchGroups(const float* levels, int n_levels);
  void Drain(int max_batches);
  static void Sort(Entry* entries, int n);
  void Batch(int* ids, float* lower, int n);
  void CheckAll();
  int CheapestAccepted();
  bool KeepsLimitsOf(const Curve& plan) const {
    const Limits& l = problem_->limits;
    const bool any = l.speed > 0.0 || l.acceleration > 0.0 || l.height || l.tan_elevation > 0.0 ||
                     l.min_distance > 0.0 || l.view || std::isfinite(l.listed_within);
    return !any || KeepsLimits(plan, *problem_);
  }
  // `open`: the row that single precision leaves open, which decides most; -1: none.
  bool Passes(const Curve& plan, int open) {
    const bool at_edge =
        open >= 0 && !proves_all_ && !proof_->rows()[static_cast<size_t>(open)].decides;
    if (at_edge && n_at_edge_ == kMostAtEdge) {
      left_ = true;
      return false;
    }
    if ((open >= 0 && !proof_->RowHolds(open, plan)) || !KeepsLimitsOf(plan)) return false;
    if (open < 0 && !proves_all_) return true;
    const bool holds = proof_->Holds(plan);
    n_refused_ += proves_all_ && !holds;
    n_at_edge_ += at_edge && !holds;
    return holds;
  }
  // Of what is looked at.
  float Limit() const { return n_refused_ < kMostRefused ? Near(best_) : -HUGE_VALF; }
  static float Near(float best) { return best * (1.0f + kSlack); }

  PlannerConfig config_;
  const kernels::Table& kernels_;
  PlanProof* proof_ = nullptr;
  FastProblem fast_;
  std::unique_ptr<Search> fallback_;
  const Problem* problem_ = nullptr;

  std::vector<int> ids_, groups_;
  std::vector<float> values_;
  std::vector<int> states_;
  std::vector<Entry> open_, accepted_;
  int checked_ = 0, feasible_ = 0, n_refused_ = 0, n_at_edge_ = 0;
  bool proves_all_ = false, left_ = false;
  float bound_ = 0.0f, best_ = 0.0f;
  Cost winner_cost_;
};

// Tests up to kBatch candidates with their lower bounds J1 + J3 + J4. J2 comes on top first where
// there is a bound to prune by, else only for what is feasible; then they are taken in the order of
// their costs, so that limits and proofs are asked of as few as possible.
void FastSearch::Batch(int* ids, float* lower, int n) {
  for (int i = n; i < kBatch + kPad; ++i) lower[i] = 0.0f;
  const bool prune = best_ < HUGE_VALF;
  if (prune) kernels_.obstacles(fast_.context(), ids, lower, n);
  int left[kBatch + kPad], states[kBatch];
  float cost[kBatch + kPad];
  int count = 0;
  for (int i = 0; i < n; ++i) {
    if (!(lower[i] < Limit())) continue;
    cost[count] = lower[i];
    left[count++] = ids[i];
  }
  if (count == 0) return;
  checked_ += count;
  int before[kBatch];
  std::copy(left, left + count, before);
  const int kept = kernels_.check_batch(fast_.context(), left, states, count);
  if (kept == 0) return;
  for (int i = 0, at = 0; i < kept; ++i, ++at) {
    while (before[at] != left[i]) ++at;
    cost[i] = cost[at];
  }
  if (!prune) kernels_.obstacles(fast_.context(), left, cost, kept);
  Entry sorted[kBatch];
  for (int i = 0; i < kept; ++i) sorted[i] = {cost[i], i};
  Sort(sorted, kept);
  for (int i = 0; i < kept; ++i) {
    if (!(sorted[i].cost() < Limit())) break;
    const int id = left[sorted[i].id()];
    if (!Passes(fast_.PlanOf(id), states[sorted[i].id()])) continue;
    ++feasible_;
    accepted_.push_back({sorted[i].cost(), id});
    best_ = std::min(best_, sorted[i].cost());
  }
}

// Adds J3 + J4 to J1 of the candidates with low < J1 <= high, drops those above the limit, puts the
// rest on the list.
void FastSearch::Weigh(float low, float high) {
  const kernels::Context& c = fast_.context();
  ids_.resize(static_cast<size_t>(c.stride + kPad));
  const int n = kernels_.select(c, low, high, ids_.data());
  WeighListed(n);
}

void FastSearch::WeighListed(int n) {
  if (n == 0) return;
  fast_.SetCosts();
  kernels::Context& c = fast_.context();
  values_.resize(static_cast<size_t>(n + kPad));
  for (int i = 0; i < n; ++i) values_[static_cast<size_t>(i)] = c.j1[ids_[static_cast<size_t>(i)]];
  constexpr int kFirst = 4;  // of the nodes: most candidates end there
  if (Limit() < HUGE_VALF && n >= 4 * kPad) kernels_.order_nodes(c, ids_.data(), n / kPad);
  n = kernels_.distance_and_yaw(c, ids_.data(), values_.data(), n, Limit(), 0, kFirst);
  n = kernels_.distance_and_yaw(c, ids_.data(), values_.data(), n, Limit(), kFirst, kNodes);
  for (int i = 0; i < n; ++i)
    open_.push_back({values_[static_cast<size_t>(i)], ids_[static_cast<size_t>(i)]});
}

// Nothing found among the cheapest: whole groups of candidates are ruled out by one test each, and
// what is left is taken in shares of ever higher J1, from above levels[0] on.
void FastSearch::SearchGroups(const float* levels, int n_levels) {
  const kernels::Context& c = fast_.context();
  const int size = fast_.first_choices();
  fast_.AliveGroups(&groups_);
  const auto is_ruled_out = [&](const Entry& e) {
    return !std::binary_search(groups_.begin(), groups_.end(), e.id() / size);
  };
  open_.erase(std::remove_if(open_.begin(), open_.end(), is_ruled_out), open_.end());
  for (int level = 0; level < n_levels; ++level) {
    const float low = levels[level];
    const float high = std::min(Limit(), level + 1 < n_levels ? levels[level + 1] : HUGE_VALF);
    ids_.resize(groups_.size() * static_cast<size_t>(size) + kPad);
    int n = 0;
    for (const int g : groups_)
      for (int id = g * size; id < (g + 1) * size; ++id) {
        ids_[static_cast<size_t>(n)] = id;
        n += (c.j1[id] > low) & (c.j1[id] <= high);
      }
    WeighListed(n);
    Drain(8);
    if (accepted_.empty()) CheckAll();
    Drain(1 << 30);
  }
}

// Rank sort: no branch to mispredict.
void FastSearch::Sort(Entry* entries, int n) {
  float cost[kSorted];
  Entry sorted[kSorted];
  std::copy(entries, entries + n, sorted);
  for (int i = 0; i < n; ++i) cost[i] = entries[i].cost();
  for (int i = 0; i < n; ++i) {
    int before = 0;
    for (int j = 0; j < i; ++j) before += cost[j] <= cost[i];
    for (int j = i + 1; j < n; ++j) before += cost[j] < cost[i];
    sorted[before] = entries[i];
  }
  std::copy(sorted, sorted + n, entries);
}

// The cheapest of what is listed, batch by batch.
void FastSearch::Drain(int max_batches) {
  size_t at = 0;
  for (int batch = 0; batch < max_batches && at < open_.size(); ++batch) {
    if (batch % (kSorted / kBatch) == 0) {
      const auto from = open_.begin() + static_cast<std::ptrdiff_t>(at);
      const size_t n = std::min(size_t{kSorted}, open_.size() - at);
      if (at + n < open_.size())
        std::nth_element(from, from + static_cast<std::ptrdiff_t>(n), open_.end());
      Sort(&open_[at], static_cast<int>(n));
    }
    int ids[kBatch + kPad];
    float lower[kBatch + kPad];
    int n = 0;
    for (; n < kBatch && at < open_.size() && open_[at].cost() < Limit(); ++at, ++n) {
      lower[n] = open_[at].cost();
      ids[n] = open_[at].id();
    }
    if (n == 0) return open_.clear();
    Batch(ids, lower, n);
  }
  open_.erase(open_.begin(), open_.begin() + static_cast<std::ptrdiff_t>(at));
}

// Nothing found among the cheapest: test what is left side by side in memory.
void FastSearch::CheckAll() {
  int n = static_cast<int>(open_.size());
  std::sort(open_.begin(), open_.end(),
            [](const Entry& a, const Entry& b) { return a.id() < b.id(); });
  ids_.resize(static_cast<size_t>(n + kPad));
  states_.resize(static_cast<size_t>(n + kPad));
  for (int i = 0; i < n; ++i) ids_[static_cast<size_t>(i)] = open_[static_cast<size_t>(i)].id();
  checked_ += n;
  n = kernels_.check(fast_.context(), ids_.data(), states_.data(), n);
  size_t at = 0;
  for (int i = 0; i < n; ++i) {
    while (open_[at].id() != ids_[static_cast<size_t>(i)]) ++at;
    open_[static_cast<size_t>(i)] = open_[at++];
  }
  open_.resize(static_cast<size_t>(n));
}

// Single precision leaves a few that could be the best: double decides, the lower index on ties.
int FastSearch::CheapestAccepted() {
  int winner = -1;
  std::sort(accepted_.begin(), accepted_.end(),
            [](const Entry& a, const Entry& b) { return a.id() < b.id(); });
  for (const Entry& e : accepted_) {
    if (!(e.cost() < Near(best_))) continue;
    const Cost cost = fast_.CostOf(e.id());
    if (winner >= 0 && !(cost.total < winner_cost_.total)) continue;
    winner = e.id();
    winner_cost_ = cost;
  }
  return winner;
}

// Where a bound is given that few candidates stay below: all of those, and nothing else.
bool FastSearch::PruneAll() {
  constexpr size_t kFew = 512;
  Weigh(-1.0f, Limit());
  if (open_.size() > kFew) {
    open_.clear();
    fast_.SetAllCosts();
    return false;
  }
  if (!open_.empty() && fast_.SetObstacles()) Drain(1 << 30);
  return true;
}

int FastSearch::Run() {
  const kernels::Context& c = fast_.context();
  const int n = fast_.n_candidates();
  best_ = bound_;
  checked_ = feasible_ = n_refused_ = n_at_edge_ = 0;
  left_ = false;
  accepted_.clear();
  open_.clear();
  if (bound_ < HUGE_VALF && PruneAll()) return CheapestAccepted();
  if (!fast_.SetObstacles()) return -1;
  // Most promising by J1: a sample of 256 tells the value that about 1 in 32 stays below.
  const int wanted = std::min(n, std::max(64, n / 32)), samples = std::min(256, n);
  float sample[256];
  for (int i = 0; i < samples; ++i) sample[i] = c.j1[static_cast<int64_t>(i) * n / samples];
  const int rank =
      std::min(samples - 1, static_cast<int>(static_cast<int64_t>(samples) * wanted / n));
  std::nth_element(sample, sample + rank, sample + samples);
  const float cheapest = std::min(sample[rank], Limit());
  Weigh(-1.0f, cheapest);
  Drain(6);
  if (accepted_.empty()) {
    float levels[3] = {cheapest, cheapest, cheapest};
    for (const int part : {1, 2}) {  // above the cheapest: to an eighth of all, to a half, the rest
      const int at = std::max(rank, part == 1 ? samples / 8 : samples / 2);
      std::nth_element(sample, sample + at, sample + samples);
      levels[part] = sample[at];
    }
    SearchGroups(levels, 3);
  } else {
    Weigh(cheapest, Limit());
  }
  Drain(1 << 30);
  return CheapestAccepted();
}

}  // namespace

std::unique_ptr<Search> MakeFastSearch(const PlannerConfig& config) {
  return MakeFastSearch(config, kernels::Kernels());
}

std::unique_ptr<Search> MakeFastSearch(const PlannerConfig& config, const kernels::Table& table) {
  return std::make_unique<FastSearch>(config, table);
}

}  // namespace chase::planning
