#pragma once

#include <Eigen/Core>
#include <vector>

namespace chase::mapping {

using Points2 = std::vector<Eigen::Vector2d>;

/// { x : (x - center)' shape (x - center) <= 1 } in the plane.
struct Ellipse {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();     ///< m
  Eigen::Matrix2d shape = Eigen::Matrix2d::Identity();  ///< 1/m^2, positive definite
  double Level(const Eigen::Vector2d& x) const { return (x - center).dot(shape * (x - center)); }
  double Area() const;
  /// Larger and smaller semi-axis, m.
  Eigen::Vector2d SemiAxes() const;
  Ellipse Scaled(double factor) const { return {center, shape / (factor * factor)}; }
};

/// Rectangle of least area: center + side * axis, columns of `axes` are its directions.
struct Rectangle {
  Eigen::Vector2d center = Eigen::Vector2d::Zero();
  Eigen::Matrix2d axes = Eigen::Matrix2d::Identity();  ///< first column: along the longer side
  Eigen::Vector2d half = Eigen::Vector2d::Zero();      ///< half lengths, m; first the longer
  double Area() const { return 4.0 * half.x() * half.y(); }
};

/// Convex hull, counter-clockwise, without collinear points (Andrew's monotone chain).
Points2 ConvexHull(Points2 points);

/// Rectangle of least area around a convex hull: one side lies on an edge of the hull.
Rectangle SmallestRectangle(const Points2& hull);

/// Circle of least radius around the points, as an Ellipse (Welzl, iterative; deterministic).
Ellipse SmallestCircle(const Points2& points);

/// Ellipse of least area around the points, area within (1 + tolerance) of the least; all points
/// are inside. Khachiyan's algorithm with Wolfe-Atwood steps (Todd and Yildirim 2007). Point sets
/// thinner than `thinnest` m are given that half width.
Ellipse SmallestEllipse(const Points2& points, double tolerance, double thinnest);

/// Ellipse around a rectangle that reaches beyond its short sides by 15 % of the half length only
/// (the one of least area by 41 %), at the price of twice its half width. For ends of walls.
Ellipse EllipseAround(const Rectangle& rectangle);

/// Ellipsoid of least volume around points in space; same method.
struct Ellipsoid {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  Eigen::Matrix3d shape = Eigen::Matrix3d::Identity();
  double Level(const Eigen::Vector3d& x) const { return (x - center).dot(shape * (x - center)); }
};
Ellipsoid SmallestEllipsoid(const std::vector<Eigen::Vector3d>& points, double tolerance,
                            double thinnest);

}  // namespace chase::mapping
