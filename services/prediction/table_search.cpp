#include "services/prediction/table_search.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "services/prediction/pack_kernels.h"

namespace chase::prediction {
namespace {

constexpr size_t kMaxBlockers = 32;
constexpr int kBlockerSamples = 24;
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
        opened_(static_cast<size_t>(table.rows()), false) {}

  SearchResult Run() {
    SortRows();
    for (size_t next = 0; next < order_.size(); ++next) {
      const auto [bound, row] = order_[next];
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
      if (!opened_[static_cast<size_t>(row)])
        order_.emplace_back(bounds_.row[static_cast<size_t>(row)] +
                                static_cast<double>(table_.FillRow(bounds_, row, rest_.data())),
                            row);
    std::sort(order_.begin(), order_.end());
  }

  void OpenRow(int row) {
    ++result_.nodes;
    opened_[static_cast<size_t>(row)] = true;
    table_.FillRow(bounds_, row, rest_.data());
    if (KeepCheap(row) == 0) return;
    for (size_t i = 0; i < blockers_.size(); ++i)
      if (table_.Mask(blockers_[i], row, alive_.data()) == 0) {
        std::rotate(blockers_.begin(), blockers_.begin() + static_cast<ptrdiff_t>(i),
                    blockers_.begin() + static_cast<ptrdiff_t>(i) + 1);  // likely again
        return;
      }
    if (!result_.found()) FindFirst(row);
    if (result_.found()) FindCheaper(row);
  }

  int KeepCheap(int row) {
    const double room = result_.cost * bounds_.scale - bounds_.row[static_cast<size_t>(row)];
    int count = 0;
    for (size_t j = 0; j < alive_.size(); ++j) {
      alive_[j] = static_cast<double>(rest_[j]) < room && j < static_cast<size_t>(table_.columns());
      count += alive_[j];
    }
    return count;
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
    blockers_.push_back(table_.MakeBlocker(obstacle, nearest.tau));
    table_.Mask(blockers_.back(), row, alive_.data());
  }

  const PairTable& table_;
  PairTable::Bounds bounds_;
  const std::vector<HorizonObstacle>& obstacles_;
  SearchResult result_;
  double exponent_ = 0.0;  // of the best
  std::vector<PairTable::Blocker> blockers_;
  std::vector<std::pair<double, int>> order_, open_;  // bound or cost, row or column
  std::vector<float> rest_;
  std::vector<int> alive_;
  std::vector<bool> opened_;
  int hit_ = -1;
};

}  // namespace

SearchResult TableSearch::Run(const std::vector<HorizonObstacle>& obstacles) const {
  return Progress(table_, bounds_, obstacles).Run();
}

}  // namespace chase::prediction
