#include "services/prediction/table_search.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace chase::prediction {
namespace {

constexpr size_t kMaxBlockers = 400;
constexpr int kBlockerSamples = 24;
constexpr double kDeepEnough = 0.999;  // a place less deep inside blocks little

int FirstBit(uint32_t bits) { return __builtin_ctz(bits); }
uint32_t FirstBits(int count) { return count >= 32 ? ~0U : (1U << count) - 1U; }

// One run through the table.
class Progress {
 public:
  Progress(const CandidateTable& table, const std::vector<HorizonObstacle>& obstacles,
           int64_t visit_limit)
      : table_(table), obstacles_(obstacles), visit_limit_(visit_limit) {}

  SearchResult Run() {
    const std::vector<float> bounds = table_.RowBounds(), middles = table_.RowMiddles();
    std::vector<std::pair<float, int>> order;
    for (int row = 0; row < table_.rows(); ++row)
      order.emplace_back(middles[static_cast<size_t>(row)], row);
    std::sort(order.begin(), order.end());
    result_.lower_bound = std::numeric_limits<double>::infinity();
    for (const auto& [middle, row] : order) {
      const double bound = static_cast<double>(bounds[static_cast<size_t>(row)]);
      if (bound >= result_.cost) continue;
      result_.complete = result_.complete && result_.nodes < visit_limit_;
      if (result_.complete)
        OpenRow(row);
      else
        result_.lower_bound = std::min(result_.lower_bound, bound);
    }
    result_.lower_bound = std::min(result_.lower_bound, result_.cost);
    return result_;
  }

 private:
  struct Open {
    float bound;
    int group, point;
    bool operator<(const Open& other) const {  // the cheapest on top of a heap
      return bound != other.bound ? bound > other.bound
                                  : std::pair(group, point) > std::pair(other.group, other.point);
    }
  };

  void OpenRow(int row) {
    ++result_.nodes;
    open_.clear();
    const size_t known = blockers_.size();
    const CandidateTable::Lanes bounds = table_.GroupBounds(row);
    for (uint32_t left = GroupsLeft(row, bounds); left != 0; left &= left - 1U)
      OpenGroup(row, FirstBit(left));
    std::make_heap(open_.begin(), open_.end());
    while (!open_.empty() && static_cast<double>(open_.front().bound) < result_.cost) {
      std::pop_heap(open_.begin(), open_.end());
      const Open next = open_.back();
      open_.pop_back();
      if (!IsBlocked(row, next, known)) Test(row, next);
    }
  }

  // Groups that may hold something cheap and clear.
  uint32_t GroupsLeft(int row, const CandidateTable::Lanes& bounds) const {
    uint32_t left = 0;
    for (int g = 0; g < table_.groups(); ++g)
      if (static_cast<double>(bounds[static_cast<size_t>(g)]) < result_.cost) left |= 1U << g;
    for (size_t i = blockers_.size(); i-- > 0 && left != 0;)
      left &= ~table_.BlockedGroups(blockers_[i], row, left);
    return left;
  }

  void OpenGroup(int row, int group) {
    ++result_.nodes;
    uint32_t left = FirstBits(table_.points());
    for (size_t i = blockers_.size(); i-- > 0 && left != 0;)
      left &= ~table_.BlockedPoints(blockers_[i], row, group, left);
    if (left == 0) return;
    const CandidateTable::Lanes bounds = table_.PointBounds(row, group, left);
    for (; left != 0; left &= left - 1U) {
      const int point = FirstBit(left);
      const float bound = bounds[static_cast<size_t>(point)];
      if (static_cast<double>(bound) < result_.cost) open_.push_back({bound, group, point});
    }
  }

  // By what was struck out since the row was opened.
  bool IsBlocked(int row, const Open& open, size_t known) const {
    for (size_t i = known; i < blockers_.size(); ++i)
      if (table_.BlockedPoints(blockers_[i], row, open.group, 1U << open.point) != 0) return true;
    return false;
  }

  // Certified test; takes the candidate as the best when it is clear and cheaper.
  void Test(int row, const Open& open) {
    const CandidateSet& candidates = table_.candidates();
    const Choice choice = table_.ChoiceOf(row, open.group, open.point);
    const Eigen::VectorXd delta = candidates.Delta(choice);
    const double cost = candidates.Cost(delta);
    if (!(cost < result_.cost)) return;
    ++result_.checked;
    const Coefficients q = candidates.CoefficientsOf(delta);
    if (!IsClear(q, obstacles_, &hit_)) return AddBlocker(q);
    result_.choice = choice;
    result_.cost = cost;
  }

  void AddBlocker(const Coefficients& q) {
    if (blockers_.size() >= kMaxBlockers) return;
    const HorizonObstacle& obstacle = obstacles_[static_cast<size_t>(hit_)];
    const Nearest nearest = NearestApproach(q, obstacle, kBlockerSamples);
    if (nearest.distance < kDeepEnough)
      blockers_.push_back(table_.MakeBlocker(obstacle, nearest.tau));
  }

  const CandidateTable& table_;
  const std::vector<HorizonObstacle>& obstacles_;
  int64_t visit_limit_;
  SearchResult result_;
  std::vector<CandidateTable::Blocker> blockers_;
  std::vector<Open> open_;  // candidates of the row, a heap
  int hit_ = -1;
};

}  // namespace

SearchResult TableSearch::Run(const std::vector<HorizonObstacle>& obstacles,
                              int64_t visit_limit) const {
  return Progress(table_, obstacles, visit_limit).Run();
}

}  // namespace chase::prediction
