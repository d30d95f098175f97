#include "services/mapping/enclosing.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace chase::mapping {

namespace {

double Cross(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return a.x() * b.y() - a.y() * b.x();
}

Ellipse Circle(const Eigen::Vector2d& center, double radius) {
  return {center, Eigen::Matrix2d::Identity() / (radius * radius)};
}

/// Circle through two or three points: centre and squared radius.
struct Ball {
  Eigen::Vector2d center;
  double squared = -1.0;
  bool Holds(const Eigen::Vector2d& p) const {
    return (p - center).squaredNorm() <= squared * (1.0 + 1e-12) + 1e-18;
  }
};

Ball Through(const Eigen::Vector2d& a, const Eigen::Vector2d& b) {
  return {0.5 * (a + b), 0.25 * (a - b).squaredNorm()};
}

Ball Through(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const Eigen::Vector2d& c) {
  const Eigen::Vector2d u = b - a, v = c - a;
  const double d = 2.0 * Cross(u, v);
  if (std::abs(d) < 1e-15) {  // on a line: the farthest pair
    Ball best = Through(a, b);
    for (const Ball& other : {Through(a, c), Through(b, c)})
      if (other.squared > best.squared) best = other;
    return best;
  }
  const Eigen::Vector2d o(v.y() * u.squaredNorm() - u.y() * v.squaredNorm(),
                          u.x() * v.squaredNorm() - v.x() * u.squaredNorm());
  return {a + o / d, (o / d).squaredNorm()};
}

/// Weights u of the dual optimum: the ellipsoid of least volume has covariance sum u_i q_i q_i'.
template <int N>
struct Khachiyan {
  using Lifted = Eigen::Matrix<double, N + 1, 1>;
  std::vector<Lifted> q;
  std::vector<double> u, m;

  explicit Khachiyan(const std::vector<Eigen::Matrix<double, N, 1>>& points)
      : q(points.size()),
        u(points.size(), 1.0 / static_cast<double>(points.size())),
        m(points.size()) {
    for (size_t i = 0; i < points.size(); ++i) q[i] << points[i], 1.0;
  }

  void Solve(double tolerance) {
    for (int iteration = 0; iteration < 2000; ++iteration)
      if (!Step(tolerance)) return;
  }

  /// One step toward the worst point or away from the least useful one; false when done.
  bool Step(double tolerance) {
    Eigen::Matrix<double, N + 1, N + 1> x = Eigen::Matrix<double, N + 1, N + 1>::Zero();
    for (size_t i = 0; i < q.size(); ++i)
      if (u[i] > 0.0) x += u[i] * q[i] * q[i].transpose();
    const Eigen::Matrix<double, N + 1, N + 1> inverse = x.inverse();
    size_t worst = 0, least = q.size();
    for (size_t i = 0; i < q.size(); ++i) {
      m[i] = q[i].dot(inverse * q[i]);
      if (m[i] > m[worst]) worst = i;
      if (u[i] > 0.0 && (least == q.size() || m[i] < m[least])) least = i;
    }
    const double d = N + 1;
    const double up = m[worst] / d - 1.0, down = 1.0 - m[least] / d;
    if (!(std::max(up, down) > tolerance)) return false;
    const size_t j = up >= down ? worst : least;
    double step = (m[j] / d - 1.0) / (m[j] - 1.0);
    if (j == least && up < down) step = std::max(step, -u[j] / (1.0 - u[j]));
    for (auto& weight : u) weight *= 1.0 - step;
    u[j] = std::max(0.0, u[j] + step);
    return true;
  }
};

/// Center and shape of the least ellipsoid of the points; scaled so that all points are inside.
template <int N>
void Enclose(const std::vector<Eigen::Matrix<double, N, 1>>& points, double tolerance,
             double thinnest, Eigen::Matrix<double, N, 1>* center,
             Eigen::Matrix<double, N, N>* shape) {
  using Vector = Eigen::Matrix<double, N, 1>;
  using Matrix = Eigen::Matrix<double, N, N>;
  Vector origin = Vector::Zero();
  for (const auto& p : points) origin += p / static_cast<double>(points.size());
  std::vector<Vector> set;  // each point with a small cross around it, so that the set has a volume
  for (const auto& p : points)
    for (int axis = 0; axis < N; ++axis)
      for (const double side : {-thinnest, thinnest})
        set.push_back(p - origin + side * Vector::Unit(axis));
  Khachiyan<N> dual(set);
  dual.Solve(tolerance);
  Vector mean = Vector::Zero();
  Matrix second = Matrix::Zero();
  for (size_t i = 0; i < set.size(); ++i) mean += dual.u[i] * set[i];
  for (size_t i = 0; i < set.size(); ++i)
    second += dual.u[i] * (set[i] - mean) * (set[i] - mean).transpose();
  *shape = second.inverse() / static_cast<double>(N);
  double reach = 0.0;
  for (const auto& p : set) reach = std::max(reach, (p - mean).dot(*shape * (p - mean)));
  *shape /= reach * (1.0 + 1e-9);
  *center = origin + mean;
}

}  // namespace

double Ellipse::Area() const { return M_PI / std::sqrt(shape.determinant()); }

Eigen::Vector2d Ellipse::SemiAxes() const {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(shape, Eigen::EigenvaluesOnly);
  return eigen.eigenvalues().cwiseSqrt().cwiseInverse();
}

Points2 ConvexHull(Points2 points) {
  std::sort(points.begin(), points.end(), [](const auto& a, const auto& b) {
    return a.x() != b.x() ? a.x() < b.x() : a.y() < b.y();
  });
  if (points.size() < 3) return points;
  Points2 hull(2 * points.size());
  size_t n = 0;
  const auto add = [&](const Eigen::Vector2d& p, size_t base) {
    while (n >= base + 2 && Cross(hull[n - 1] - hull[n - 2], p - hull[n - 2]) <= 0.0) --n;
    hull[n++] = p;
  };
  for (const auto& p : points) add(p, 0);
  const size_t base = n - 1;
  for (size_t i = points.size() - 1; i-- > 0;) add(points[i], base);
  hull.resize(std::max<size_t>(1, n - 1));
  return hull;
}

Rectangle SmallestRectangle(const Points2& hull) {
  Rectangle best;
  double best_area = INFINITY;
  for (size_t i = 0; i < hull.size(); ++i) {
    Eigen::Vector2d e = hull[(i + 1) % hull.size()] - hull[i];
    e = e.norm() > 1e-12 ? Eigen::Vector2d(e.normalized()) : Eigen::Vector2d::UnitX();
    Eigen::Matrix2d axes;
    axes << e, Eigen::Vector2d(-e.y(), e.x());
    Eigen::Array2d low = Eigen::Array2d::Constant(INFINITY), high = -low;
    for (const auto& p : hull) {
      const Eigen::Array2d s = axes.transpose() * p;
      low = low.min(s);
      high = high.max(s);
    }
    const Eigen::Array2d side = high - low;
    if (side.prod() >= best_area) continue;
    best_area = side.prod();
    best = {axes * (0.5 * (low + high)).matrix(), axes, 0.5 * side};
  }
  if (best.half.x() < best.half.y()) {
    best.axes.col(0).swap(best.axes.col(1));
    std::swap(best.half.x(), best.half.y());
  }
  return best;
}

Ellipse SmallestCircle(const Points2& points) {
  Ball ball{points.front(), 0.0};
  for (size_t i = 1; i < points.size(); ++i) {
    if (ball.Holds(points[i])) continue;
    ball = {points[i], 0.0};
    for (size_t j = 0; j < i; ++j) {
      if (ball.Holds(points[j])) continue;
      ball = Through(points[i], points[j]);
      for (size_t k = 0; k < j; ++k)
        if (!ball.Holds(points[k])) ball = Through(points[i], points[j], points[k]);
    }
  }
  double squared = 0.0;  // rounding leaves no point outside
  for (const auto& p : points) squared = std::max(squared, (p - ball.center).squaredNorm());
  return Circle(ball.center, std::max(1e-6, std::sqrt(squared) * (1.0 + 1e-9)));
}

Ellipse SmallestEllipse(const Points2& points, double tolerance, double thinnest) {
  Ellipse e;
  Enclose<2>(points, tolerance, thinnest, &e.center, &e.shape);
  return e;
}

Ellipse EllipseAround(const Rectangle& r) {
  // (1/1.1547)^2 + (1/2)^2 = 1: the corners lie on the ellipse.
  const Eigen::Array2d axes =
      r.half.array().max(0.01) * Eigen::Array2d(2.0 / std::sqrt(3.0), 2.0) * (1.0 + 1e-9);
  return {r.center, r.axes * axes.square().inverse().matrix().asDiagonal() * r.axes.transpose()};
}

Ellipsoid SmallestEllipsoid(const std::vector<Eigen::Vector3d>& points, double tolerance,
                            double thinnest) {
  Ellipsoid e;
  Enclose<3>(points, tolerance, thinnest, &e.center, &e.shape);
  return e;
}

}  // namespace chase::mapping
