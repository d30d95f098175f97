#include "test/baselines/hierarchical/quadratic_program.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>
#include <vector>

namespace chase::baselines {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kFeasible = 1e-9;
constexpr double kParallel = 1e-12;

/// min 1/2 x'Hx + g'x subject to C x >= d, H positive definite.
class DualActiveSet {
 public:
  DualActiveSet(const MatrixXd& H, const VectorXd& g, const MatrixXd& C, const VectorXd& d)
      : C_(C), d_(d) {
    const Eigen::LLT<MatrixXd> llt(H);
    sound_ = llt.info() == Eigen::Success;
    if (!sound_) return;
    inverse_ = llt.solve(MatrixXd::Identity(H.rows(), H.cols()));
    x_ = -inverse_ * g;
  }

  std::optional<VectorXd> Run(int max_steps) {
    while (sound_ && x_.allFinite()) {
      const int broken = MostBroken();
      if (broken < 0) return x_;
      if (!Enforce(broken, &max_steps)) return std::nullopt;
    }
    return std::nullopt;
  }

 private:
  int MostBroken() const {
    if (C_.rows() == 0) return -1;
    int worst = -1;
    return (C_ * x_ - d_).minCoeff(&worst) < -kFeasible ? worst : -1;
  }

  // Steps in primal and dual space until the constraint holds, dropping those whose multiplier
  // comes to zero on the way.
  bool Enforce(int added, int* steps) {
    const VectorXd normal = C_.row(added).transpose();
    double multiplier = 0.0;
    while ((*steps)-- > 0) {
      MatrixXd N(normal.size(), static_cast<Eigen::Index>(active_.size()));
      for (size_t k = 0; k < active_.size(); ++k)
        N.col(static_cast<Eigen::Index>(k)) = C_.row(active_[k]).transpose();
      const MatrixXd HN = inverse_ * N;
      const VectorXd r = (N.transpose() * HN).ldlt().solve(HN.transpose() * normal);
      const VectorXd z = inverse_ * normal - HN * r;
      const double slope = z.dot(normal);
      double dual = HUGE_VAL;
      size_t drop = 0;
      for (size_t k = 0; k < active_.size(); ++k) {
        const double rk = r[static_cast<Eigen::Index>(k)];
        if (rk > kParallel && u_[k] / rk < dual) dual = u_[k] / rk, drop = k;
      }
      const double gap = d_[added] - normal.dot(x_);
      const double primal = slope > kParallel * normal.squaredNorm() ? gap / slope : HUGE_VAL;
      const double step = std::min(primal, dual);
      if (!std::isfinite(step)) return false;
      if (std::isfinite(primal)) x_ += step * z;
      for (size_t k = 0; k < active_.size(); ++k) u_[k] -= step * r[static_cast<Eigen::Index>(k)];
      multiplier += step;
      if (primal <= dual) {
        active_.push_back(added);
        u_.push_back(multiplier);
        return true;
      }
      active_.erase(active_.begin() + static_cast<long>(drop));
      u_.erase(u_.begin() + static_cast<long>(drop));
    }
    return false;
  }

  const MatrixXd& C_;
  const VectorXd& d_;
  MatrixXd inverse_;
  VectorXd x_;
  std::vector<int> active_;
  std::vector<double> u_;
  bool sound_ = false;
};

}  // namespace

std::optional<VectorXd> Solve(const QuadraticProgram& qp, int max_steps) {
  const Eigen::Index n = qp.H.rows(), m = qp.A.rows();
  const Eigen::HouseholderQR<MatrixXd> qr(qp.A.transpose());
  const MatrixXd Q = qr.householderQ() * MatrixXd::Identity(n, n);
  const MatrixXd Y = Q.leftCols(m), Z = Q.rightCols(n - m);
  const VectorXd particular =
      Y * (qp.A * Y).partialPivLu().solve(qp.b);  // A Y is square and triangular
  if (!particular.allFinite()) return std::nullopt;
  const MatrixXd H = Z.transpose() * qp.H * Z;
  const VectorXd g = Z.transpose() * (qp.H * particular + qp.g);
  const MatrixXd C = qp.C * Z;
  const VectorXd d = qp.d - qp.C * particular;
  const auto y = DualActiveSet(H, g, C, d).Run(max_steps);
  if (!y) return std::nullopt;
  return VectorXd(particular + Z * *y);
}

}  // namespace chase::baselines
