#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <set>

#include "services/mapping/decomposition.h"
#include "services/mapping/enclosing.h"

namespace chase::mapping {
namespace {

Points2 RandomPoints(std::mt19937* random, int n, double stretch) {
  std::normal_distribution<double> normal;
  Points2 points;
  const double a = normal(*random);
  for (int i = 0; i < n; ++i) {
    const Eigen::Vector2d p(stretch * normal(*random), normal(*random));
    points.emplace_back(5.0 + std::cos(a) * p.x() - std::sin(a) * p.y(),
                        -3.0 + std::sin(a) * p.x() + std::cos(a) * p.y());
  }
  return points;
}

/// Least area over ellipses found by random descent from the given one: an independent bound.
double BruteForceArea(const Points2& points, Ellipse e, std::mt19937* random) {
  std::normal_distribution<double> normal;
  double best = INFINITY, size = 0.3;
  Eigen::Matrix2d root = e.shape.llt().matrixU();
  Eigen::Vector2d center = e.center;
  for (int i = 0; i < 20000; ++i, size = std::max(1e-4, size * 0.9995)) {
    Eigen::Matrix2d candidate = root;
    Eigen::Vector2d c = center;
    for (int k = 0; k < 4; ++k) candidate(k / 2, k % 2) *= 1.0 + size * 0.3 * normal(*random);
    for (int k = 0; k < 2; ++k) c[k] += size * 0.3 * normal(*random);
    double reach = 0.0;
    for (const auto& p : points) reach = std::max(reach, (candidate * (p - c)).squaredNorm());
    const double area = M_PI * reach / std::abs(candidate.determinant());
    if (area >= best) continue;
    best = area;
    root = candidate / std::sqrt(reach);
    center = c;
  }
  return best;
}

TEST(MappingEnclosing, EllipseHoldsEveryPointAndIsLeast) {
  std::mt19937 random(11);
  for (int round = 0; round < 5; ++round) {
    const Points2 points = RandomPoints(&random, 12, 1.0 + round);
    const Ellipse e = SmallestEllipse(points, 1e-3, 1e-6);
    for (const auto& p : points) EXPECT_LE(e.Level(p), 1.0 + 1e-9) << "seed 11, round " << round;
    EXPECT_LE(e.Area(), BruteForceArea(points, e.Scaled(1.5), &random) * 1.01) << "round " << round;
  }
}

TEST(MappingEnclosing, EllipseOfRectangleIsKnown) {
  const Points2 corners = {{2, 1}, {-2, 1}, {-2, -1}, {2, -1}};
  const Eigen::Vector2d axes = SmallestEllipse(corners, 1e-4, 1e-9).SemiAxes();
  EXPECT_NEAR(axes.x(), 2.0 * std::sqrt(2.0), 0.01);
  EXPECT_NEAR(axes.y(), std::sqrt(2.0), 0.01);
}

TEST(MappingEnclosing, EllipsoidHoldsEveryPoint) {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 40; ++i)
    points.emplace_back(3.0 * normal(random), normal(random), 0.3 * normal(random));
  const Ellipsoid e = SmallestEllipsoid(points, 1e-3, 1e-6);
  double reach = 0.0;
  for (const auto& p : points) reach = std::max(reach, e.Level(p));
  EXPECT_LE(reach, 1.0 + 1e-9);
  EXPECT_GT(reach, 0.99);
}

TEST(MappingEnclosing, EllipsoidOfBoxIsKnown) {
  std::vector<Eigen::Vector3d> corners;
  for (int i = 0; i < 8; ++i) corners.emplace_back(i & 1 ? 1 : -1, i & 2 ? 2 : -2, i & 4 ? 3 : -3);
  const Ellipsoid e = SmallestEllipsoid(corners, 1e-4, 1e-9);
  for (int i = 0; i < 3; ++i)
    EXPECT_NEAR(1.0 / std::sqrt(e.shape(i, i)), (i + 1) * std::sqrt(3.0), 0.02);
}

TEST(MappingEnclosing, DegenerateSetsGiveFiniteShapes) {
  for (const Points2& points : {Points2{{1, 1}}, Points2{{0, 0}, {1, 0}},
                                Points2{{0, 0}, {1, 1}, {2, 2}}, Points2{{1, 1}, {1, 1}}}) {
    const Ellipse e = SmallestEllipse(points, 5e-3, 0.01);
    EXPECT_TRUE(e.shape.allFinite() && e.center.allFinite());
    for (const auto& p : points) EXPECT_LE(e.Level(p), 1.0 + 1e-9);
  }
}

TEST(MappingEnclosing, CircleIsLeast) {
  std::mt19937 random(3);
  for (int round = 0; round < 50; ++round) {
    const Points2 points = RandomPoints(&random, 9, 2.0);
    const Ellipse circle = SmallestCircle(points);
    const double radius = circle.SemiAxes().x();
    double best = INFINITY;  // the least circle is that of some two or three points
    for (const auto& a : points)
      for (const auto& b : points)
        for (const auto& c : points) {
          const Ellipse other = SmallestCircle({a, b, c});
          double reach = 0.0;
          for (const auto& p : points) reach = std::max(reach, (p - other.center).norm());
          best = std::min(best, reach);
        }
    EXPECT_NEAR(radius, best, 1e-6);
    for (const auto& p : points) EXPECT_LE(circle.Level(p), 1.0 + 1e-6);
  }
}

TEST(MappingEnclosing, RectangleAndItsEllipseHoldThePoints) {
  std::mt19937 random(9);
  for (int round = 0; round < 50; ++round) {
    const Points2 points = RandomPoints(&random, 20, 8.0);
    const Rectangle r = SmallestRectangle(ConvexHull(points));
    const Ellipse e = EllipseAround(r);
    for (const auto& p : points) {
      const Eigen::Vector2d s = r.axes.transpose() * (p - r.center);
      EXPECT_LE(std::abs(s.x()), r.half.x() + 1e-9);
      EXPECT_LE(std::abs(s.y()), r.half.y() + 1e-9);
      EXPECT_LE(e.Level(p), 1.0 + 1e-9);
    }
  }
}

std::vector<Cell> Columns(const std::vector<Eigen::Vector2d>& centers) {
  std::vector<Cell> cells;
  for (const auto& c : centers) {
    Cell cell;
    cell.x = static_cast<int>(std::floor(c.x() / 0.2));
    cell.y = static_cast<int>(std::floor(c.y() / 0.2));
    for (const double dx : {-0.08, 0.08})
      for (const double dy : {-0.08, 0.08}) cell.corners.emplace_back(c.x() + dx, c.y() + dy);
    cell.area = 0.16 * 0.16;
    cells.push_back(cell);
  }
  return cells;
}

TEST(MappingDecomposition, EveryColumnIsEnclosedAndIdsStay) {
  std::vector<Eigen::Vector2d> centers;  // a wall with a corner, and a pillar
  for (double s = 0.1; s < 8.0; s += 0.2) centers.emplace_back(s, 0.1);
  for (double s = 0.3; s < 6.0; s += 0.2) centers.emplace_back(0.1, s);
  for (const double dx : {-0.2, 0.0, 0.2})
    for (const double dy : {-0.2, 0.0, 0.2}) centers.emplace_back(4.1 + dx, 3.1 + dy);
  Decomposition decomposition(StaticConfig{}, 0.2);
  auto cells = Columns(centers);
  const auto first = decomposition.Update(&cells, {}, nullptr, 0.0);
  EXPECT_LE(first.size(), 12u);
  size_t members = 0;
  for (const auto& piece : first) {
    members += piece.cells.size();
    EXPECT_LE(piece.outline.SemiAxes().x(), 1.7);
    for (const int i : piece.cells)
      for (const auto& p : cells[static_cast<size_t>(i)].corners)
        EXPECT_LE(piece.outline.Level(p), 1.0 + 1e-6);
  }
  EXPECT_EQ(members, cells.size());
  const auto second = decomposition.Update(&cells, {}, nullptr, 0.0);
  ASSERT_EQ(second.size(), first.size());
  for (size_t i = 0; i < first.size(); ++i) EXPECT_EQ(first[i].id, second[i].id);
}

TEST(MappingDecomposition, PiecesOfWhichAPartIsGivenMergeWithNoOther) {
  std::vector<Eigen::Vector2d> centers;
  for (double s = 0.1; s < 8.0; s += 0.2) centers.emplace_back(s, 0.1);
  Decomposition decomposition(StaticConfig{}, 0.2);
  auto wall = Columns(centers);
  const auto pieces = decomposition.Update(&wall, {}, nullptr, 0.0);
  ASSERT_GT(pieces.size(), 1u);
  // What a window shows of two neighbours when its rim crosses both near their common end.
  std::vector<Cell> seen;
  std::set<int> ids;
  for (size_t i = 1; i < wall.size() && ids.empty(); ++i) {
    if (wall[i].piece == wall[i - 1].piece) continue;
    seen = {wall[i - 1], wall[i]};
    ids = {wall[i - 1].piece, wall[i].piece};
  }
  ASSERT_EQ(ids.size(), 2u);
  auto kept = seen;
  EXPECT_EQ(decomposition.Update(&kept, ids, nullptr, 0.0).size(), 2u);
  for (size_t i = 0; i < seen.size(); ++i) EXPECT_EQ(kept[i].piece, seen[i].piece);
  // Known to be all of them, they are one.
  EXPECT_EQ(decomposition.Update(&seen, {}, nullptr, 0.0).size(), 1u);
}

TEST(MappingDecomposition, OutlinesKeepOutOfTheTarget) {
  std::vector<Eigen::Vector2d>
      centers;  // a ring of 0.9 m diameter: one circle would hold its middle
  for (int i = 0; i < 14; ++i) {
    const double a = 2.0 * M_PI * i / 14;
    centers.emplace_back(2.1 + 0.45 * std::cos(a), 2.1 + 0.45 * std::sin(a));
  }
  Decomposition decomposition(StaticConfig{}, 0.2);
  auto cells = Columns(centers);
  const Eigen::Vector2d target(2.1, 2.1);
  for (const auto& piece : decomposition.Update(&cells, {}, &target, 0.15))
    EXPECT_GT(piece.outline.Level(target), 1.0);
}

}  // namespace
}  // namespace chase::mapping
