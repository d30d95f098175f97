#pragma once

#include <Eigen/Core>
#include <array>

#include "services/mapping/enclosing.h"

namespace chase::mapping {

/// Directions in plan, evenly spaced from +x counter-clockwise, along which outlines are measured.
inline constexpr int kDirections = 16;
Eigen::Vector2d Direction(int k);

/// How far a cluster reaches in one direction: the largest d . x of its returns.
struct Reach {
  double along = 0.0;  ///< d . x, frame W, m
  double age = 0.0;    ///< of that return at the end of the sweep, s
  bool edge = false;   ///< the body ends there; otherwise it may go on out of sight
};
using Reaches = std::array<Reach, kDirections>;

/// In how many directions a sweep showed where a body ends.
struct Sight {
  int ends = 0;
  int rigid = 0;  ///< of them, those of an end that was known before and moved as the others did
};

/// How bodies move: steadily, but for changes of velocity at once, now and then.
struct MotionNoise {
  double acceleration = 0.8;  ///< random walk of the velocity by this times the time, m/s^2
  double change_rate = 0.0;   ///< sudden changes of velocity, 1/s
  double change_speed = 1.0;  ///< standard deviation of such a change, per axis, m/s
};

/// Where returns of a body are to be expected: its support function about p, with deviations.
struct Footprint {
  int track = -1;
  Eigen::Vector2d p = Eigen::Vector2d::Zero(), v = Eigen::Vector2d::Zero();  ///< m, m/s
  std::array<double, kDirections> reach{}, sigma{};                          ///< m
  double radius = 0.0;  ///< m from p, beyond which nothing lies within four deviations

  /// How many deviations a return of this age [s] lies beyond the outline; negative inside.
  double Excess(const Eigen::Vector2d& q, double age) const;
};

/// A body of unknown convex outline that moves without turning much. Kalman filter of a point that
/// is fixed to it, of its velocity, and of the outline's support function about that point (cf.
/// Sun, Li and Lan 2014, extended objects by support functions): a sweep measures d_k . (p - age v)
/// + h_k where the body's end is in view. What comes into view, or is hidden, on one side changes
/// the outline there and leaves the motion alone. Two hypotheses a sweep, that the velocity has
/// gone on and that it has changed at once, are merged by their likelihood: the generalised
/// pseudo-Bayesian filter of first order (Ackerson and Fu 1970), to which the interacting multiple
/// model comes down where changes do not depend on each other.
class BodyFilter {
 public:
  static constexpr int kStates = 4 + kDirections;
  using State = Eigen::Matrix<double, kStates, 1>;
  using Covariance = Eigen::Matrix<double, kStates, kStates>;

  BodyFilter() = default;
  /// A body at rest, give or take `speed` m/s, about `center`; where no end is in view the outline
  /// is that of `seen` give or take `unseen` m.
  BodyFilter(const Eigen::Vector2d& center, const Reaches& seen, double speed, double unseen);

  /// Moves on by dt s.
  void Predict(double dt, const MotionNoise& noise);
  /// Takes a sweep's reaches; `sigma`: standard deviation of one of them, m; `unseen`: as above.
  Sight Correct(const Reaches& seen, double sigma, double unseen);
  /// Where its returns should be; deviations with a sudden change, at most `most` m.
  Footprint Expected(double sigma, double most) const;
  /// How unlikely ends in view are: mean of innovation^2 / s + log(s / least^2), s: its variance,
  /// at least `least`^2 m^2. Below zero if nothing can be compared.
  double Distance(const Reaches& seen, double sigma, double least) const;

  Eigen::Vector2d p() const { return x_.head<2>(); }
  Eigen::Vector2d v() const { return x_.segment<2>(2); }
  /// Corners of the outline about p, counter-clockwise; empty if the reaches contradict each other.
  Points2 Outline() const;
  /// Variance of the outline's centre and of the velocity, mean over the axes, m^2 and m^2/s^2.
  double CenterVariance() const;
  double VelocityVariance() const;

 private:
  using Row = Eigen::Matrix<double, 1, kStates>;
  static Row Model(int k, double age);
  void Uncover(const Reaches& seen, double unseen);
  double Update(const Eigen::MatrixXd& model, const Eigen::VectorXd& z, double sigma, State* x,
                Covariance* P) const;
  Covariance Changed() const;
  int Reshape(const Reaches& seen, const std::array<double, kDirections>& innovation);

  /// Where an end was last in view, m from p, and how sure that is: it grows while the end is seen.
  struct End {
    double place = 0.0;
    int points = 0;
  };

  State x_ = State::Zero();
  std::array<End, kDirections> ends_{};
  Covariance P_ = Covariance::Zero();  ///< if the velocity went on
  double change_ = 0.0;                ///< probability that it has changed since the last sweep
  double change_speed_ = 0.0;          ///< m/s
  double change_time_ = 0.0;           ///< s, within which it has
};

}  // namespace chase::mapping
