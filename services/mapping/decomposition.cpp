#include "services/mapping/decomposition.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace chase::mapping {

namespace {

constexpr double kRoundRatio = 2.0;   // a circle is taken while it is not this much larger
constexpr double kWallAspect = 3.0;   // length over width from which a piece counts as wall
constexpr double kThinnest = 0.01;    // m, half width of a degenerate piece
constexpr double kWasteShare = 0.65;  // an ellipse around a filled rectangle wastes 57 %
constexpr double kSplitStrictness = 1.5, kMergeStrictness = 0.8;  // apart: no flutter
constexpr int kMergeRounds = 6;
constexpr int kForcedCuts = 4;
constexpr int kForcedIds = 1 << 24;  // ids of parts that only keep the target free

/// Cells by column, to find neighbours.
class Neighbours {
 public:
  explicit Neighbours(const std::vector<Cell>& cells) {
    for (size_t i = 0; i < cells.size(); ++i)
      index_.push_back({Code(cells[i].x, cells[i].y), static_cast<int>(i)});
    std::sort(index_.begin(), index_.end());
  }
  /// Calls f(index) for each of the up to eight occupied columns around `cell`.
  template <class F>
  void ForEach(const Cell& cell, F&& f) const {
    for (int dx = -1; dx <= 1; ++dx) {
      const int64_t first = Code(cell.x + dx, cell.y - 1);
      auto it = std::lower_bound(index_.begin(), index_.end(), std::make_pair(first, 0));
      for (; it != index_.end() && it->first <= first + 2; ++it)
        if (it->first != Code(cell.x, cell.y)) f(it->second);
    }
  }

 private:
  static int64_t Code(int x, int y) {
    return (static_cast<int64_t>(x) << 32) + (static_cast<int64_t>(y) + (1LL << 31));
  }
  std::vector<std::pair<int64_t, int>> index_;
};

double FilledArea(const std::vector<Cell>& cells, const std::vector<int>& group) {
  double area = 0.0;
  for (const int i : group) area += cells[static_cast<size_t>(i)].area;
  return area;
}

/// The ellipse with both semi-axes grown by `margin` m.
Ellipse Grown(const Ellipse& e, double margin) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(e.shape);
  const Eigen::Array2d radius = eigen.eigenvalues().array().rsqrt() + margin;
  return {e.center, eigen.eigenvectors() * radius.square().inverse().matrix().asDiagonal() *
                        eigen.eigenvectors().transpose()};
}

}  // namespace

Decomposition::Decomposition(const StaticConfig& config, double resolution)
    : config_(config), resolution_(resolution) {}

Points2 Decomposition::Hull(const std::vector<Cell>& cells, const Group& group) const {
  Points2 points;
  for (const int i : group) {
    const auto& corners = cells[static_cast<size_t>(i)].corners;
    points.insert(points.end(), corners.begin(), corners.end());
  }
  return ConvexHull(std::move(points));
}

Ellipse Decomposition::Outline(const Points2& points) const {
  const Points2 hull = ConvexHull(points);
  const Rectangle rectangle = SmallestRectangle(hull);
  const Ellipse circle = SmallestCircle(hull);
  const double radius = circle.SemiAxes().x();
  if (radius <= config_.compact_radius &&
      circle.Area() <= kRoundRatio * M_PI_2 * std::max(rectangle.Area(), 1e-4))
    return circle;
  if (rectangle.half.x() > kWallAspect * rectangle.half.y()) return EllipseAround(rectangle);
  return SmallestEllipse(hull, config_.tolerance_permille * 1e-3, kThinnest);
}

bool Decomposition::Tight(const std::vector<Cell>& cells, const Group& group,
                          double strictness) const {
  if (group.size() <= 1) return true;
  const Points2 hull = Hull(cells, group);
  const Rectangle rectangle = SmallestRectangle(hull);
  const double length = 2.0 * rectangle.half.x();
  const double slack = strictness > 1.0 ? 2.0 * resolution_ : 0.0;
  const Ellipse outline = Outline(hull);
  const Eigen::Vector2d axes = outline.SemiAxes();
  if (axes.x() <= config_.compact_radius * (axes.x() < 1.05 * axes.y() ? 1.0 : 0.5)) return true;
  if (length > config_.max_length + slack) return false;
  const double filled = FilledArea(cells, group);
  return outline.Area() - filled <=
         strictness * std::max(config_.waste * length, kWasteShare * filled);
}

/// Cuts a group in two: a long one into equal parts, another where two rectangles waste least.
bool Decomposition::Cut(const std::vector<Cell>& cells, const Group& group, Group* a,
                        Group* b) const {
  if (group.size() < 2) return false;
  const Rectangle box = SmallestRectangle(Hull(cells, group));
  const auto divide = [&](const Eigen::Vector2d& axis, double offset, Group* low, Group* high) {
    low->clear();
    high->clear();
    for (const int i : group) {
      const Cell& cell = cells[static_cast<size_t>(i)];
      const Eigen::Vector2d p(resolution_ * (cell.x + 0.5), resolution_ * (cell.y + 0.5));
      (axis.dot(p - box.center) < offset ? low : high)->push_back(i);
    }
    return !low->empty() && !high->empty();
  };
  const double parts = std::ceil(2.0 * box.half.x() / config_.max_length - 1e-9);
  if (parts > 1.0) {
    const double share = std::floor(parts / 2.0) / parts;
    if (divide(box.axes.col(0), (2.0 * share - 1.0) * box.half.x(), a, b)) return true;
  }
  double best = INFINITY;
  Group low, high;
  const Eigen::Vector2d u = box.axes.col(0), v = box.axes.col(1);
  for (const Eigen::Vector2d& axis :
       {u, v, Eigen::Vector2d((u + v).normalized()), Eigen::Vector2d((u - v).normalized())}) {
    const double reach =
        std::abs(axis.dot(u)) * box.half.x() + std::abs(axis.dot(v)) * box.half.y();
    for (const double share : {-0.7, -0.4, -0.2, 0.0, 0.2, 0.4, 0.7}) {
      if (!divide(axis, share * reach, &low, &high)) continue;
      const double area =
          SmallestRectangle(Hull(cells, low)).Area() + SmallestRectangle(Hull(cells, high)).Area();
      if (area >= best) continue;
      best = area;
      *a = low;
      *b = high;
    }
  }
  return best < INFINITY;
}

void Decomposition::Split(const std::vector<Cell>& cells, const Group& group,
                          std::vector<Group>* out) const {
  Group a, b;
  if (Tight(cells, group, 1.0) || !Cut(cells, group, &a, &b)) {
    out->push_back(group);
    return;
  }
  Split(cells, a, out);
  Split(cells, b, out);
}

/// New columns join the neighbouring piece that stays tight with the least outline.
void Decomposition::Adopt(const std::vector<Cell>& cells, std::map<int, Group>* groups,
                          Group* orphans) const {
  if (groups->empty()) return;
  const Neighbours neighbours(cells);
  std::vector<int> piece(cells.size(), 0);
  for (const auto& [id, group] : *groups)
    for (const int i : group) piece[static_cast<size_t>(i)] = id;
  Group left;
  for (const int i : *orphans) {
    std::set<int> candidates;
    neighbours.ForEach(cells[static_cast<size_t>(i)], [&](int j) {
      if (piece[static_cast<size_t>(j)]) candidates.insert(piece[static_cast<size_t>(j)]);
    });
    int best = 0;
    double best_area = INFINITY;
    for (const int id : candidates) {
      Group with = groups->at(id);
      with.push_back(i);
      if (!Tight(cells, with, 1.0)) continue;
      const double area = SmallestRectangle(Hull(cells, with)).Area();
      if (area < best_area) best = id, best_area = area;
    }
    if (!best) {
      left.push_back(i);
      continue;
    }
    groups->at(best).push_back(i);
    piece[static_cast<size_t>(i)] = best;
  }
  *orphans = left;
}

/// Columns without a piece: connected components, split until they are tight.
void Decomposition::AddNew(const std::vector<Cell>& cells, const Group& orphans,
                           std::map<int, Group>* groups) {
  const Neighbours neighbours(cells);
  std::vector<char> open(cells.size(), 0);
  for (const int i : orphans) open[static_cast<size_t>(i)] = 1;
  for (const int seed : orphans) {
    if (!open[static_cast<size_t>(seed)]) continue;
    Group component{seed};
    open[static_cast<size_t>(seed)] = 0;
    for (size_t head = 0; head < component.size(); ++head) {
      neighbours.ForEach(cells[static_cast<size_t>(component[head])], [&](int j) {
        if (!open[static_cast<size_t>(j)]) return;
        open[static_cast<size_t>(j)] = 0;
        component.push_back(j);
      });
    }
    std::vector<Group> parts;
    Split(cells, component, &parts);
    for (auto& part : parts) (*groups)[next_id_++] = std::move(part);
  }
}

/// The largest part keeps the id.
void Decomposition::SplitWasteful(const std::vector<Cell>& cells, std::map<int, Group>* groups) {
  std::vector<int> wasteful;
  for (const auto& [id, group] : *groups)
    if (!Tight(cells, group, kSplitStrictness)) wasteful.push_back(id);
  for (const int id : wasteful) {
    std::vector<Group> parts;
    Split(cells, groups->at(id), &parts);
    std::stable_sort(parts.begin(), parts.end(),
                     [](const Group& a, const Group& b) { return a.size() > b.size(); });
    groups->at(id) = parts.front();
    for (size_t i = 1; i < parts.size(); ++i) (*groups)[next_id_++] = std::move(parts[i]);
  }
}

/// Neighbouring pieces become one, under the older id, where that wastes nothing. True if some did.
bool Decomposition::Merge(const std::vector<Cell>& cells, const std::set<int>& partial,
                          std::map<int, Group>* groups) const {
  const Neighbours neighbours(cells);
  std::vector<int> piece(cells.size(), 0);
  for (const auto& [id, group] : *groups)
    for (const int i : group) piece[static_cast<size_t>(i)] = id;
  std::set<std::pair<int, int>> pairs;
  for (const auto& cell : cells) {
    const int a = piece[static_cast<size_t>(&cell - cells.data())];
    neighbours.ForEach(cell, [&](int j) {
      const int b = piece[static_cast<size_t>(j)];
      if (a && b && a < b) pairs.insert({a, b});
    });
  }
  bool merged = false;
  for (const auto& [a, b] : pairs) {
    if (partial.count(a) || partial.count(b)) continue;
    const auto first = groups->find(a), second = groups->find(b);
    if (first == groups->end() || second == groups->end()) continue;
    Group both = first->second;
    both.insert(both.end(), second->second.begin(), second->second.end());
    if (!Tight(cells, both, kMergeStrictness)) continue;
    first->second = std::move(both);
    groups->erase(second);
    merged = true;
  }
  return merged;
}

void Decomposition::Emit(const std::vector<Cell>& cells, int id, const Group& group,
                         const Eigen::Vector2d* keep_out, double keep_out_radius, int depth,
                         std::vector<Piece>* pieces) {
  const Points2 hull = Hull(cells, group);
  Piece piece{id, group, Outline(hull), SmallestRectangle(hull)};
  Rectangle& box = piece.rectangle;
  box.center = piece.outline.center;
  box.half.setConstant(kThinnest);
  for (const Eigen::Vector2d& p : hull) {
    box.half = box.half.cwiseMax((box.axes.transpose() * (p - box.center)).cwiseAbs());
    piece.radius = std::max(piece.radius, (p - box.center).norm());
  }
  if (!keep_out || Grown(piece.outline, keep_out_radius).Level(*keep_out) > 1.0) {
    pieces->push_back(std::move(piece));
    return;
  }
  Group a, b;
  if (depth >= kForcedCuts || !Cut(cells, group, &a, &b)) {
    ++dropped_;
    return;
  }
  if (a.size() < b.size()) std::swap(a, b);
  Emit(cells, id, a, keep_out, keep_out_radius, depth + 1, pieces);
  Emit(cells, id + (kForcedIds << depth), b, keep_out, keep_out_radius, depth + 1, pieces);
}

std::vector<Piece> Decomposition::Update(std::vector<Cell>* cells, const std::set<int>& partial,
                                         const Eigen::Vector2d* keep_out, double keep_out_radius) {
  std::map<int, Group> groups;
  Group orphans;
  for (size_t i = 0; i < cells->size(); ++i) {
    const int id = (*cells)[i].piece;
    (id ? groups[id] : orphans).push_back(static_cast<int>(i));
  }
  Adopt(*cells, &groups, &orphans);
  AddNew(*cells, orphans, &groups);
  SplitWasteful(*cells, &groups);
  for (int round = 0; round < kMergeRounds && Merge(*cells, partial, &groups); ++round) {
  }
  std::vector<Piece> pieces;
  dropped_ = 0;
  for (const auto& [id, group] : groups) {
    for (const int i : group) (*cells)[static_cast<size_t>(i)].piece = id;
    Emit(*cells, id, group, keep_out, keep_out_radius, 0, &pieces);
  }
  return pieces;
}

}  // namespace chase::mapping
