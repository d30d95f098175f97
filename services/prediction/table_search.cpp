#include "services/prediction/table_search.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "services/prediction/pack_kernels.h"

namespace chase::prediction {
namespace {

constexpr size_t kMaxBlockers = 128;
constexpr int kBlockerSamples = 24;
constexpr float kInfinity = std::numeric_limits<float>::infinity();
constexpr double kSharp = 1.0;  // bounds are made anew when log e^x has moved by more

// One run through the table.
class Progress {
 public:
  Progress(const PairTable& table, const PairTable::Bounds& bounds,
           const std::vector<HorizonObstacle>& obstacles)
      : table_(table),
        bounds_(bounds),
        obstacles_(obstacles),
        rest_(static_cast<size_t>(table.blocks() * kLanes)),
        alive_(rest_.size()),
        done_(static_cast<size_t>(table.rows()), false) {}

  SearchResult Run() {
    SortRows();
    for (size_t next = 0; next < order_.size(); ++next) {
      const auto [bound, row] = order_[next];
      if (done_[static_cast<size_t>(row)]) continue;
      if (bound >= result_.cost * bounds_.scale) break;
      OpenRow(row);
      if (!result_.found() || std::abs(exponent_ - bounds_.tangent) <= kSharp) continue;
      bounds_ = table_.MakeBounds(exponent_);
      SortRows();
      next = static_cast<size_t>(-1);
    }
    result_.lower_bound = result_.cost;
    return result_;
  }

 private:
  void SortRows() {
    order_.clear();
    for (int row = 0; row < table_.rows(); ++row)
      if (!done_[static_cast<size_t>(row)])
        order_.emplace_back(bounds_.row[static_cast<size_t>(row)] +
                                static_cast<double>(table_.FillRow(bounds_, row, rest_.data())),
                            row);
    std::sort(order_.begin(), order_.end());
  }

  void OpenRow(int row) {
    ++result_.nodes;
    done_[static_cast<size_t>(row)] = true;
    table_.FillRow(bounds_, row, rest_.data());
    const int cheap = KeepCheap(row);
    if (cheap == 0 || MaskAll(row, cheap) == 0) return;
    if (!result_.found()) FindFirst(row);
    if (result_.found()) FindCheaper(row);
  }

  // Blockers that block most go first.
  int MaskAll(int row, int left) {
    for (size_t i = 0; i < blockers_.size() && left > 0; ++i) {
      const int before = left;
      left = table_.Mask(*blockers_[i].blocker, row, alive_.data());
      blockers_[i].kills += before - left;
      if (i > 0 && blockers_[i].kills > blockers_[i - 1].kills)
        std::swap(blockers_[i], blockers_[i - 1]);
    }
    return left;
  }

  // Rounded up, so that nothing cheap is lost.
  int KeepCheap(int row) {
    const double room = result_.cost * bounds_.scale - bounds_.row[static_cast<size_t>(row)];
    const float limit = std::nextafter(static_cast<float>(room), kInfinity);
    return KeepBelow(rest_.data(), limit, table_.blocks(), alive_.data());
  }

  // Until something is known to be clear: by bounds, which saves the exact costs.
  void FindFirst(int row) {
    while (!result_.found()) {
      int least = -1;
      for (int j = 0; j < table_.columns(); ++j)
        if (alive_[static_cast<size_t>(j)] &&
            (least < 0 || rest_[static_cast<size_t>(j)] < rest_[static_cast<size_t>(least)]))
          least = j;
      if (least < 0) return;
      Test(row, least);
    }
  }

  void FindCheaper(int row) {
    open_.clear();
    const double room = result_.cost * bounds_.scale - bounds_.row[static_cast<size_t>(row)];
    for (int j = 0; j < table_.columns(); ++j) {
      if (!alive_[static_cast<size_t>(j)] ||
          static_cast<double>(rest_[static_cast<size_t>(j)]) >= room)
        continue;
      const double cost = table_.Cost(row, j);
      if (cost < result_.cost) open_.emplace_back(cost, j);
    }
    std::sort(open_.begin(), open_.end());
    for (const auto& [cost, column] : open_)
      if (alive_[static_cast<size_t>(column)] && Test(row, column)) return;
  }

  // Certified test of one pair; takes it as the best when it is clear.
  bool Test(int row, int column) {
    ++result_.checked;
    alive_[static_cast<size_t>(column)] = 0;
    Choice choice = table_.ChoiceOf(row, column);
    const CandidateSet& candidates = table_.candidates();
    const Coefficients q = candidates.CoefficientsOf(candidates.Delta(choice));
    if (!IsClear(q, obstacles_, &hit_)) {
      AddBlocker(q, row);
      return false;
    }
    result_.choice = std::move(choice);
    result_.cost = table_.Cost(row, column);
    exponent_ = table_.Exponent(row, column);
    return true;
  }

  void AddBlocker(const Coefficients& q, int row) {
    if (blockers_.size() >= kMaxBlockers) return;
    const HorizonObstacle& obstacle = obstacles_[static_cast<size_t>(hit_)];
    const Nearest nearest = NearestApproach(q, obstacle, kBlockerSamples);
    if (nearest.distance > 0.95) return;
    blockers_.push_back(
        {std::make_unique<PairTable::Blocker>(table_.MakeBlocker(obstacle, nearest.tau)), 0});
    const PairTable::Blocker& added = *blockers_.back().blocker;
    for (const int blocked : added.blocked_rows) done_[static_cast<size_t>(blocked)] = true;
    table_.Mask(added, row, alive_.data());
  }

  const PairTable& table_;
  PairTable::Bounds bounds_;
  const std::vector<HorizonObstacle>& obstacles_;
  SearchResult result_;
  double exponent_ = 0.0;  // of the best
  struct Counted {
    std::unique_ptr<PairTable::Blocker> blocker;
    int64_t kills;
  };
  std::vector<Counted> blockers_;
  std::vector<std::pair<double, int>> order_, open_;  // bound or cost, row or column
  std::vector<float> rest_;
  std::vector<int> alive_;
  std::vector<bool> done_;  // rows that were opened or are known to collide as a whole
  int hit_ = -1;
};

}  // namespace

SearchResult TableSearch::Run(const std::vector<HorizonObstacle>& obstacles) const {
  return Progress(table_, bounds_, obstacles).Run();
}

}  // namespace chase::prediction
