#include "test/unit/separation_model.h"

#include <Eigen/Eigenvalues>

namespace chase::world {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Solves sum (a_i y_i / (a_i^2 + t))^2 = 1 for t >= 0, y outside, by Newton's method from the
/// left: the sum is convex and falls.
Vector3d NearestOnAxes(const Vector3d& a, const Vector3d& y) {
  if (y.cwiseQuotient(a).squaredNorm() <= 1.0) return y;
  const Vector3d ay = a.cwiseProduct(y), aa = a.cwiseAbs2();
  double t = std::max(0.0, (ay.cwiseAbs() - aa).maxCoeff());
  for (int i = 0; i < 100; ++i) {
    const Vector3d w = ay.array() / (aa.array() + t);
    const double f = w.squaredNorm() - 1.0;
    const double slope = 2.0 * (w.array().square() / (aa.array() + t)).sum();
    const double next = t + f / slope;
    if (!(next > t)) break;
    t = next;
  }
  return aa.cwiseProduct(y).array() / (aa.array() + t);
}

/// Of the ellipsoid { x' Q^-1 x <= 1 }.
struct Axes {
  Matrix3d R;
  Vector3d half;

  explicit Axes(const Matrix3d& Q) {
    const Eigen::SelfAdjointEigenSolver<Matrix3d> eigen(Q);
    R = eigen.eigenvectors();
    half = eigen.eigenvalues().cwiseMax(1e-14).cwiseSqrt();
  }
  Vector3d Nearest(const Vector3d& x) const { return R * NearestOnAxes(half, R.transpose() * x); }
};

Vector3d At(const Curve& curve, double tau) {
  Vector3d x = Vector3d::Zero();
  for (Eigen::Index k = curve.rows(); k-- > 0;) x = x * tau + curve.row(k).transpose();
  return x;
}

/// Least of a convex function on [0,1] by golden section.
template <class F>
double LeastOf(F&& f, double low, double high, int steps) {
  constexpr double kGolden = 0.6180339887498949;
  double a = high - kGolden * (high - low), b = low + kGolden * (high - low);
  double fa = f(a), fb = f(b), least = std::min({f(low), f(high), fa, fb});
  for (int i = 0; i < steps; ++i) {
    if (fa < fb) {
      high = b, b = a, fb = fa;
      fa = f(a = high - kGolden * (high - low));
    } else {
      low = a, a = b, fa = fb;
      fb = f(b = low + kGolden * (high - low));
    }
    least = std::min({least, fa, fb});
  }
  return least;
}

Matrix3d Covariance(const Body& body, double tau) {
  return body.covariance[0] + tau * body.covariance[1] + tau * tau * body.covariance[2];
}

/// Distances from the solid with its uncertainty.
class Model {
 public:
  explicit Model(const Body& body)
      : body_(body),
        solid_(body.kind == Body::Kind::kEllipsoid ? body.shape : Matrix3d(Matrix3d::Identity())),
        spread_(Matrix3d::Identity()) {}

  void SetTime(double tau) {
    if (body_.sigmas == 0.0) return;
    const Matrix3d S = Covariance(body_, tau);
    round_ = S.isDiagonal(1e-12) && S.diagonal().maxCoeff() == S.diagonal().minCoeff();
    radius_ = body_.sigmas * std::sqrt(S(0, 0));
    if (!round_) spread_ = Axes(body_.sigmas * body_.sigmas * S);
  }
  double Distance(const Vector3d& x) const {
    if (body_.sigmas == 0.0) return (x - Nearest(x)).norm();
    if (round_) return (x - Nearest(x)).norm() - radius_;
    return DistanceFromSum(x);
  }

 private:
  /// Minimises |x - u - v|, u in the solid, v in the ellipsoid of uncertainty: accelerated
  /// projected gradients with restarts (O'Donoghue and Candes 2015).
  double DistanceFromSum(const Vector3d& x) const {
    const auto step = [&](const Vector3d& v) { return spread_.Nearest(x - Nearest(x - v)); };
    Vector3d v = step(Vector3d::Zero()), y = v;
    double momentum = 1.0;
    for (int i = 0; i < 5000; ++i) {
      Vector3d next = step(y);
      if ((y - next).dot(next - v) > 0.0) {
        momentum = 1.0;
        next = step(v);
      }
      const double more = 0.5 * (1.0 + std::sqrt(1.0 + 4.0 * momentum * momentum));
      y = next + (momentum - 1.0) / more * (next - v);
      momentum = more;
      const bool settled = (next - v).norm() < 1e-13;
      v = next;
      if (settled || (x - v - Nearest(x - v)).norm() < 1e-11) break;
    }
    return (x - v - Nearest(x - v)).norm();
  }
  Vector3d Nearest(const Vector3d& x) const {
    return body_.kind == Body::Kind::kEllipsoid ? solid_.Nearest(x) : NearestPoint(body_, x);
  }

  const Body& body_;
  Axes solid_, spread_;
  bool round_ = true;
  double radius_ = 0.0;
};

double SpeedBound(const SeparationPair& pair) {
  double speed = 1.0;  // of the uncertainty
  for (int k = 1; k < pair.drone.center.rows(); ++k) {
    const Vector3d c = k < pair.body.center.rows() ? Vector3d(pair.body.center.row(k))
                                                   : Vector3d(Vector3d::Zero());
    const Vector3d q = k < pair.target.center.rows() ? Vector3d(pair.target.center.row(k))
                                                     : Vector3d(Vector3d::Zero());
    speed += k * std::max((Vector3d(pair.drone.center.row(k)) - c).norm(), (q - c).norm());
  }
  return speed;
}

/// At tau; where it is above `interest`, a lower bound that is above it, too, will do.
double Gap(Model* model, const SeparationPair& pair, double tau, double interest) {
  model->SetTime(tau);
  const Vector3d c = At(pair.body.center, tau), p = At(pair.drone.center, tau) - c,
                 q = At(pair.target.center, tau) - c;
  const double r = math::Evaluate(pair.drone.radius, tau),
               rq = math::Evaluate(pair.target.radius, tau);
  const auto gap = [&](double s) {
    return model->Distance((1.0 - s) * p + s * q) - (1.0 - s) * r - s * rq;
  };
  if (!pair.sight) return gap(0.0);
  double bound = HUGE_VAL;
  for (int i = 0; i < 4; ++i)
    bound = std::min(bound, gap((i + 0.5) / 4.0) - ((q - p).norm() + std::abs(rq - r)) / 8.0);
  return bound > interest ? bound : LeastOf(gap, 0.0, 1.0, 40);
}

}  // namespace

Vector3d NearestPoint(const Body& body, const Vector3d& x) {
  if (body.kind == Body::Kind::kEllipsoid) return Axes(body.shape).Nearest(x);
  if (body.kind == Body::Kind::kBox) {
    const Vector3d local = body.shape.transpose() * x;
    return body.shape * local.cwiseMax(-body.half).cwiseMin(body.half);
  }
  Vector3d near = x;
  const double across = x.head<2>().norm();
  if (across > body.half.x()) near.head<2>() *= body.half.x() / across;
  near.z() = std::clamp(x.z(), -body.half.z(), body.half.z());
  return near;
}

double GapAt(const SeparationPair& pair, double tau) {
  Model model(pair.body);
  return Gap(&model, pair, tau, HUGE_VAL);
}

// Steps as far as the gap cannot close meanwhile, 1/256 at least, then refines about the least.
double LeastGap(const SeparationPair& pair) {
  constexpr double kStep = 1.0 / 256.0;
  const double speed = SpeedBound(pair);
  Model model(pair.body);
  double least = HUGE_VAL, where = 0.0;
  for (double tau = 0.0;;) {
    const double gap = Gap(&model, pair, tau, least);
    if (gap < least) least = gap, where = tau;
    if (least < -1e-6) return least;
    if (tau >= 1.0) break;
    tau = std::min(1.0, tau + std::max(kStep, 0.9 * (gap - least) / speed));
  }
  const auto gap = [&](double tau) { return Gap(&model, pair, tau, least); };
  return std::min(least,
                  LeastOf(gap, std::max(0.0, where - kStep), std::min(1.0, where + kStep), 25));
}

}  // namespace chase::world
