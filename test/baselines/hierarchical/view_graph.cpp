#include "test/baselines/hierarchical/view_graph.h"

#include <algorithm>
#include <cmath>

namespace chase::baselines {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Visibility scores around one future place of the target: the least clearance of the line of
/// sight, floored at `min_sight`. Obstacles are upright, so one score serves a column of cells.
class ScoreField {
 public:
  ScoreField(const HierarchicalParameters& p, const DistanceField& field, const Vector2d& target)
      : cell_(p.cell), floor_(p.min_sight) {
    const double reach = p.max_distance + p.connect * p.retry_factor;
    first_x_ = static_cast<int>(std::floor((target.x() - reach) / cell_));
    first_y_ = static_cast<int>(std::floor((target.y() - reach) / cell_));
    n_ = static_cast<int>(std::ceil(2.0 * reach / cell_)) + 1;
    score_.reserve(static_cast<size_t>(n_) * static_cast<size_t>(n_));
    for (int j = 0; j < n_; ++j)
      for (int i = 0; i < n_; ++i)
        score_.push_back(std::max(floor_, field.LeastAlong(target, Point(i, j), floor_)));
  }

  Vector2d Point(int i, int j) const { return {cell_ * (first_x_ + i), cell_ * (first_y_ + j)}; }
  int n() const { return n_; }
  double Of(int i, int j) const {
    return score_[static_cast<size_t>(j) * static_cast<size_t>(n_) + static_cast<size_t>(i)];
  }

  /// Mean along a segment, sampled each cell.
  double MeanAlong(const Vector2d& a, const Vector2d& b) const {
    const int steps = std::max(1, static_cast<int>(std::ceil((b - a).norm() / cell_)));
    double sum = 0.0;
    for (int k = 0; k <= steps; ++k) sum += Nearest(a + (b - a) * (static_cast<double>(k) / steps));
    return sum / (steps + 1);
  }

 private:
  double Nearest(const Vector2d& p) const {
    const int i = static_cast<int>(std::lround(p.x() / cell_)) - first_x_;
    const int j = static_cast<int>(std::lround(p.y() / cell_)) - first_y_;
    return i >= 0 && j >= 0 && i < n_ && j < n_ ? Of(i, j) : floor_;
  }

  double cell_, floor_;
  int first_x_ = 0, first_y_ = 0, n_ = 0;
  std::vector<double> score_;
};

/// Cells above one place in the plane, their costs so far, and where those come from.
struct Column {
  Vector2d p;
  std::vector<double> z, stay, cost;  ///< stay: w_d | |node - target| - desired |
  std::vector<int> column, level;     ///< predecessor
  double cheapest = HUGE_VAL;
};

std::vector<Column> Columns(const HierarchicalParameters& p, const DistanceField& field,
                            const ScoreField& score, const Vector3d& target, double safe) {
  const int levels = static_cast<int>(std::lround(p.box_height / p.cell)) + 1;
  const double tan_elevation = std::tan(p.max_elevation_deg * M_PI / 180.0);
  std::vector<Column> columns;
  for (int j = 0; j < score.n(); ++j)
    for (int i = 0; i < score.n(); ++i) {
      Column c;
      c.p = score.Point(i, j);
      const double planar = (c.p - target.head<2>()).norm();
      if (planar >= p.max_distance || score.Of(i, j) <= p.min_sight + 0.01 || field.At(c.p) <= safe)
        continue;
      for (int k = 0; k < levels; ++k) {
        const double up = p.cell * k, distance = std::hypot(planar, up);
        if (distance <= p.min_distance || distance >= p.max_distance ||
            up >= planar * tan_elevation)
          continue;
        c.z.push_back(target.z() + up);
        c.stay.push_back(p.weight_distance * std::abs(distance - p.desired_distance));
      }
      c.cost.assign(c.z.size(), HUGE_VAL);
      c.column = c.level = std::vector<int>(c.z.size(), -1);
      if (!c.z.empty()) columns.push_back(c);
    }
  return columns;
}

/// One relaxation sweep from a layer to the next. Edges are only looked at when a bound from below
/// on their weight could improve a node.
class Sweep {
 public:
  Sweep(const HierarchicalParameters& p, const DistanceField& field, const ScoreField* before,
        const ScoreField& here, double safe, double reach)
      : p_(p), field_(field), before_(before), here_(here), safe_(safe), reach_(reach) {}

  void Relax(std::vector<Column>* from, std::vector<Column>* to) const {
    std::vector<int> order;
    for (size_t i = 0; i < from->size(); ++i)
      if ((*from)[i].cheapest < HUGE_VAL) order.push_back(static_cast<int>(i));
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
      return (*from)[static_cast<size_t>(a)].cheapest < (*from)[static_cast<size_t>(b)].cheapest;
    });
    for (int i : order)
      for (Column& c : *to) Relax((*from)[static_cast<size_t>(i)], i, &c);
    for (Column& c : *to) c.cheapest = *std::min_element(c.cost.begin(), c.cost.end());
  }

 private:
  void Relax(const Column& a, int index, Column* b) const {
    const double planar2 = (a.p - b->p).squaredNorm();
    if (planar2 >= reach_ * reach_) return;
    const double least = p_.weight_sight / p_.field_cut;  // a score is at most the field's cut
    double sight = -1.0;                                  // of this pair, once it is known
    for (size_t l = 0; l < b->z.size(); ++l)
      for (size_t k = 0; k < a.z.size(); ++k) {
        const double rise = b->z[l] - a.z[k], length = std::sqrt(planar2 + rise * rise);
        const double rest = a.cost[k] + length + b->stay[l];
        if (length >= reach_ || rest + (sight < 0.0 ? least : sight) >= b->cost[l]) continue;
        if (sight < 0.0) sight = Sight(a.p, b->p);
        if (rest + sight >= b->cost[l]) continue;
        b->cost[l] = rest + sight;
        b->column[l] = index;
        b->level[l] = static_cast<int>(k);
      }
  }

  double Sight(const Vector2d& a, const Vector2d& b) const {
    // The root may stand nearer to an obstacle than nodes may; an edge must not come nearer still.
    const double safe = before_ ? safe_ : std::min(safe_, field_.At(a) - 0.02);
    if (field_.LeastAlong(a, b, safe) < safe) return HUGE_VAL;
    const double mean = here_.MeanAlong(a, b);
    return p_.weight_sight / std::sqrt(before_ ? mean * before_->MeanAlong(a, b) : mean);
  }

  const HierarchicalParameters& p_;
  const DistanceField& field_;
  const ScoreField* before_;
  const ScoreField& here_;
  double safe_, reach_;
};

std::vector<Vector3d> Trace(const std::vector<std::vector<Column>>& layers) {
  int column = -1, level = -1;
  double best = HUGE_VAL;
  for (size_t i = 0; i < layers.back().size(); ++i)
    for (size_t k = 0; k < layers.back()[i].cost.size(); ++k)
      if (layers.back()[i].cost[k] < best) {
        best = layers.back()[i].cost[k];
        column = static_cast<int>(i);
        level = static_cast<int>(k);
      }
  std::vector<Vector3d> way;
  if (column < 0) return way;
  for (size_t n = layers.size(); n-- > 0;) {
    const Column& c = layers[n][static_cast<size_t>(column)];
    way.emplace_back(c.p.x(), c.p.y(), c.z[static_cast<size_t>(level)]);
    column = c.column[static_cast<size_t>(level)];
    level = c.level[static_cast<size_t>(level)];
  }
  std::reverse(way.begin(), way.end());
  return way;
}

}  // namespace

std::vector<Vector3d> CheapestViews(const HierarchicalParameters& parameters,
                                    const DistanceField& field, const Vector3d& root,
                                    const std::vector<Vector3d>& targets, double layer_time) {
  std::vector<ScoreField> scores;
  for (const Vector3d& q : targets) scores.emplace_back(parameters, field, q.head<2>());
  std::vector<std::vector<Column>> layers(1);
  layers[0].push_back({root.head<2>(), {root.z()}, {0.0}, {0.0}, {-1}, {-1}, 0.0});
  for (size_t n = 0; n < targets.size(); ++n) {
    layers.push_back(Columns(parameters, field, scores[n], targets[n], parameters.safe));
    const Sweep sweep(parameters, field, n > 0 ? &scores[n - 1] : nullptr, scores[n],
                      parameters.safe, parameters.connect * layer_time);
    sweep.Relax(&layers[n], &layers[n + 1]);
    if (layers[n + 1].empty()) return {};
  }
  return Trace(layers);
}

}  // namespace chase::baselines
