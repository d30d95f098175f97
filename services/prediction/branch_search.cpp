#include "services/prediction/branch_search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <queue>

#include "services/prediction/hull_bound.h"

namespace chase::prediction {
namespace {

constexpr int kRootRounds = 30;
constexpr int kNodeRounds = 6;
constexpr int kTimes = 16;  // at which a node may lie wholly inside an obstacle

struct Node {
  double bound;
  int64_t number;  // of creation: breaks ties the same way every time
  HullPoint hull;
};
struct Later {
  bool operator()(const Node& a, const Node& b) const {
    return a.bound != b.bound ? a.bound > b.bound : a.number > b.number;
  }
};

// Whitened place y = L' (q(tau) - c(tau)) of a candidate relative to one obstacle at one time.
struct Probe {
  Eigen::Vector3d middle;
  std::vector<Eigen::Matrix3Xd> offsets;  // per step, a column per point
};

std::vector<Probe> MakeProbes(const CandidateSet& c,
                              const std::vector<HorizonObstacle>& obstacles) {
  std::vector<Probe> probes;
  for (const HorizonObstacle& obstacle : obstacles)
    for (int s = 0; s <= kTimes; ++s) {
      const double tau = static_cast<double>(s) / kTimes;
      const Eigen::Matrix3d Lt = obstacle.shape.llt().matrixU();
      const auto powers = [tau](Eigen::Index rows) {
        Eigen::RowVectorXd p = Eigen::RowVectorXd::Ones(rows);
        for (Eigen::Index k = 1; k < rows; ++k) p[k] = p[k - 1] * tau;
        return p;
      };
      const Eigen::RowVectorXd phi = powers(c.rows());
      Probe probe{
          Lt * (phi * c.mean_fit() - powers(obstacle.center.rows()) * obstacle.center).transpose(),
          {}};
      for (int n = 0; n < c.steps(); ++n) {
        Eigen::Matrix3Xd at = Eigen::Matrix3Xd::Zero(3, c.samples());
        for (int a = 0; a < c.axes(); ++a)
          at.row(a) = phi * c.contributions(n).middleRows(a * c.rows(), c.rows());
        probe.offsets.push_back(Lt * at);
      }
      probes.push_back(probe);
    }
  return probes;
}

// True when every allowed arrangement lies inside the unit sphere: the ball about the middles of
// the allowed points does.
bool WhollyInside(const Probe& probe, const HullPoint& hull) {
  Eigen::Vector3d center = probe.middle;
  double reach = 0.0;
  for (size_t n = 0; n < probe.offsets.size() && reach < 1.0; ++n) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    int count = 0;
    for (int i = 0; i < probe.offsets[n].cols(); ++i)
      if (hull.allowed[n] >> i & 1U) middle += probe.offsets[n].col(i), ++count;
    middle /= count;
    double radius = 0.0;
    for (int i = 0; i < probe.offsets[n].cols(); ++i)
      if (hull.allowed[n] >> i & 1U)
        radius = std::max(radius, (probe.offsets[n].col(i) - middle).norm());
    center += middle;
    reach += radius;
  }
  return center.norm() + reach < 1.0 - 1e-9;
}

class Search {
 public:
  Search(const CandidateSet& candidates, const std::vector<HorizonObstacle>& obstacles)
      : c_(candidates), obstacles_(obstacles), probes_(MakeProbes(candidates, obstacles)) {}

  SearchResult Run(int node_limit) {
    Push(WholeHull(c_), kRootRounds);
    while (!open_.empty() && open_.top().bound < result_.cost) {
      if (result_.nodes >= node_limit) {
        result_.complete = false;
        break;
      }
      Node node = open_.top();
      open_.pop();
      ++result_.nodes;
      Expand(node);
    }
    result_.lower_bound = result_.complete ? result_.cost : open_.top().bound;
    return result_;
  }

 private:
  // Bounds a node, tries its rounded arrangement and keeps it if something better may be in it.
  void Push(HullPoint hull, int rounds) {
    if (std::any_of(probes_.begin(), probes_.end(),
                    [&](const Probe& p) { return WhollyInside(p, hull); }))
      return;
    const double bound = HullLowerBound(c_, rounds, result_.cost, &hull, &reduced_);
    if (bound >= result_.cost || !StrikeOut(bound, &hull)) return;
    Try(Rounded(hull));
    if (!IsSingle(hull)) open_.push({bound, created_++, std::move(hull)});
  }

  bool StrikeOut(double bound, HullPoint* hull) {
    for (int n = 0; n < c_.steps(); ++n)
      for (int i = 0; i < c_.samples(); ++i)
        if ((hull->allowed[static_cast<size_t>(n)] >> i & 1U) &&
            bound + reduced_(i, n) >= result_.cost && !Forbid(c_, n, i, hull))
          return false;
    return true;
  }

  void Expand(const Node& node) {
    const int step = MostDivided(node.hull);
    std::vector<std::pair<double, int>> order;
    for (int i = 0; i < c_.samples(); ++i)
      if (node.hull.allowed[static_cast<size_t>(step)] >> i & 1U)
        order.emplace_back(-node.hull.weights(i, step), i);
    std::sort(order.begin(), order.end());
    for (const auto& [weight, point] : order) {
      HullPoint child = node.hull;
      Fix(c_, step, point, &child);
      Push(std::move(child), kNodeRounds);
    }
  }

  int MostDivided(const HullPoint& hull) const {
    int best = -1;
    double most = -1.0;
    for (int n = 0; n < c_.steps(); ++n) {
      const uint32_t allowed = hull.allowed[static_cast<size_t>(n)];
      const double divided = 1.0 - hull.weights.col(n).maxCoeff();
      if ((allowed & (allowed - 1U)) && divided > most) best = n, most = divided;
    }
    return best;
  }

  static bool IsSingle(const HullPoint& hull) {
    return std::all_of(hull.allowed.begin(), hull.allowed.end(),
                       [](uint32_t a) { return (a & (a - 1U)) == 0; });
  }

  Choice Rounded(const HullPoint& hull) const {
    Choice choice;
    for (int n = 0; n < c_.steps(); ++n) {
      int best = -1;
      for (int i = 0; i < c_.samples(); ++i)
        if ((hull.allowed[static_cast<size_t>(n)] >> i & 1U) &&
            (best < 0 || hull.weights(i, n) > hull.weights(best, n)))
          best = i;
      choice.push_back(best);
    }
    return choice;
  }

  void Try(const Choice& choice) {
    const Eigen::VectorXd delta = c_.Delta(choice);
    const double cost = c_.Cost(delta);
    if (!(cost < result_.cost)) return;
    ++result_.checked;
    if (!IsClear(c_.CoefficientsOf(delta), obstacles_, &hit_)) return;
    result_.choice = choice;
    result_.cost = cost;
  }

  const CandidateSet& c_;
  const std::vector<HorizonObstacle>& obstacles_;
  std::vector<Probe> probes_;
  std::priority_queue<Node, std::vector<Node>, Later> open_;
  SearchResult result_;
  Eigen::MatrixXd reduced_;
  int64_t created_ = 0;
  int hit_ = -1;
};

}  // namespace

SearchResult BranchSearch(const CandidateSet& candidates,
                          const std::vector<HorizonObstacle>& obstacles, int node_limit) {
  return Search(candidates, obstacles).Run(node_limit);
}

}  // namespace chase::prediction
