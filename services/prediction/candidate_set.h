#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "services/prediction/observation.h"
#include "services/prediction/predictor_config.h"

namespace chase::prediction {

/// Row k belongs to tau^k, tau = (t - now) / horizon; columns x y z in frame W, m.
using Coefficients = Eigen::Matrix<double, Eigen::Dynamic, 3>;

/// One point per observation: index of the point chosen at each step.
using Choice = std::vector<int>;

/// exp(x) up to x = 600 and its tangent beyond: finite, increasing and convex. Sums with numbers
/// far below e^600 keep the order that exp would give them.
double GuardedExp(double x);
double GuardedExpSlope(double x);

/// All N_v^N_o candidates of Jeon 2021, section III-A, as sums of contributions.
///
/// The coefficients that minimise eq. (8) are linear in the points V, q = q_mean + sum_n c(n, V_n),
/// where c(n, i) belongs to the offset of point i from mean n. With delta = sum_n c(n, V_n) the
/// objective of Problem 1 is
///   J(delta) = A(delta) + GuardedExp(log w_q + B(delta)),
/// A the integral of the squared acceleration, B half the sum of squared Mahalanobis distances.
/// Both are convex quadratics. The constant prod_n p_N(mean_n)^-1, the same for every candidate, is
/// taken into w_q, so that candidates rank as in the paper and nothing overflows.
///
/// On purpose different from the paper, with `motion.steady`: the fit through the means is replaced
/// by the forecast of a steadily driving target (steady_motion.h), the densities are centred on
/// that motion, and accelerations count relative to it: the candidates are its deviations, and the
/// smoothest likely one that is clear wins. Without, q_mean is eq. (8)'s own.
///
/// On purpose different from eq. (8) in both: points are sampled around the newest `steps`
/// observations; the integrals start at the newest observation when that is
/// older than `now`, so that a fit to old observations does not swing in between; the squared speed
/// is weighed in with `damping`; covariances have a floor, `spread` where points are sampled; and
/// when the middle of the candidates is faster than max_target_speed, the coefficients of tau^1 and
/// up are scaled down for all candidates alike.
class CandidateSet {
 public:
  /// `observations` at least one, sorted, at times <= now, finite.
  CandidateSet(const PredictorConfig& config, const std::vector<Observation>& observations,
               double now);

  int steps() const { return static_cast<int>(contributions_.size()); }
  int samples() const { return samples_; }
  int rows() const { return rows_; }  ///< coefficients per axis, degree + 1
  int axes() const { return axes_; }  ///< 2 when planar, else 3
  int dims() const { return rows_ * axes_; }
  double horizon() const { return horizon_; }
  /// N_v^N_o, held at 2^62.
  int64_t count() const;

  /// c(n, i) as column i of matrix n; entry rows() * axis + k.
  const Eigen::MatrixXd& contributions(int step) const {
    return contributions_[static_cast<size_t>(step)];
  }
  Eigen::VectorXd Delta(const Choice& choice) const;
  Coefficients CoefficientsOf(const Eigen::VectorXd& delta) const;
  /// The middle of the candidates: all offsets zero.
  /// True when it is a candidate, and no other costs less.
  bool IsMiddleCheapest() const { return relative_; }
  const Coefficients& mean_fit() const { return mean_fit_; }

  /// Quadratic a0 + g' delta + delta' H delta.
  struct Quadratic {
    double constant = 0.0;
    Eigen::VectorXd gradient;
    Eigen::MatrixXd hessian_half;
    double operator()(const Eigen::VectorXd& delta) const {
      return constant + delta.dot(gradient + hessian_half * delta);
    }
  };
  const Quadratic& smoothness() const { return smoothness_; }  ///< A, m^2/s^3
  const Quadratic& exponent() const { return exponent_; }      ///< log w_q + B
  double Cost(const Eigen::VectorXd& delta) const {
    return smoothness_(delta) + GuardedExp(exponent_(delta));
  }

  /// Of the fit through the means, at now: m^2 and m^2/s^2.
  Eigen::Matrix3d PositionCovariance() const { return Covariance(0); }
  Eigen::Matrix3d VelocityCovariance() const { return Covariance(1) / (horizon_ * horizon_); }

 private:
  Eigen::Matrix3d Covariance(int row) const;
  void Fit(const PredictorConfig& config, const std::vector<Observation>& observations);
  void FitSteady(const PredictorConfig& config, const std::vector<Observation>& observations,
                 double now);
  void Slow(double max_speed);
  void AddPoints(const PredictorConfig& config);
  void MakeSmoothness();
  void MakeExponent(const PredictorConfig& config, const std::vector<Observation>& observations);

  int samples_, rows_, axes_;
  double horizon_;
  bool relative_;                             // costs count from the steady motion
  double from_;                               // tau where the integrals start, <= 0
  Eigen::MatrixXd powers_;                    // column n: tau_n^k
  Eigen::MatrixXd map_;                       // column n: coefficients per metre of point n
  std::vector<Eigen::Matrix3d> covariances_;  // floored, m^2
  std::vector<Eigen::Matrix3d> spreads_;      // that points are sampled from, m^2
  std::vector<Eigen::MatrixXd> contributions_;
  Coefficients mean_fit_;
  Quadratic smoothness_, exponent_;
};

}  // namespace chase::prediction
