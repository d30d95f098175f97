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
  int stood = 0;        ///< sweeps in which it did not move

  /// How many deviations a return of this age [s] lies beyond the outline; negative inside.
  double Excess(const Eigen::Vector2d& q, double age) const;
};

/// A body of unknown convex outline that moves without turning much. Kalman filter of a point that
/// is fixed to it, of its velocity, and of the outline's support function about that point (cf.
/// Sun, Li and Lan 2014, extended objects by support functions): a sweep measures d_k . (p - age v)
/// + h_k where the body's end is in view. What comes into view, or is hidden, on one side changes
/// the outline there and leaves the motion alone. Two hypotheses a sweep, that the velocity has
/// gone on and that it has changed at once, are told apart by two sweeps and merged then by their
/// likelihood: the generalised pseudo-Bayesian filter of second order (Chang and Athans 1978). What
/// a sweep shows is older than its end by the age of its returns, and so are the changes that it
/// can tell of.
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

  Eigen::Vector2d p() const { return all_.x.head<2>(); }
  Eigen::Vector2d v() const { return all_.x.segment<2>(2); }
  /// Corners of the outline about p, counter-clockwise; empty if the reaches contradict each other.
  Points2 Outline() const;
  /// Variance of the outline's centre and of the velocity, mean over the axes, m^2 and m^2/s^2.
  double CenterVariance() const;
  /// The same along the unit vector d, or a direction next to it.
  double CenterVariance(const Eigen::Vector2d& d) const;
  double VelocityVariance() const;
  /// The same of p, m^2.
  double PlaceVariance() const { return 0.5 * all_.P.diagonal().head<2>().sum(); }

 private:
  using Row = Eigen::Matrix<double, 1, kStates>;
  /// What may be, and how likely it is.
  struct Hypothesis {
    State x = State::Zero();
    Covariance P = Covariance::Zero();
    double weight = 0.0;
  };
  static Row Model(int k, double age);
  static Hypothesis Merged(const Hypothesis& a, const Hypothesis& b);
  void Take(const Hypothesis& went_on, const Hypothesis& changed);
  Hypothesis Changed(const Hypothesis& before, double from) const;
  double ChangeSince(double from) const;
  void Uncover(const Reaches& seen, double unseen);
  double ReachVariance(int k) const;
  int Reshape(const Reaches& seen, const std::array<double, kDirections>& innovation);

  /// Where an end was last in view, m from p, and how sure that is: it grows while the end is seen.
  struct End {
    double place = 0.0;
    int points = 0;
  };

  std::array<End, kDirections> ends_{};
  std::array<Hypothesis, 2> ways_{};  ///< the velocity went on until the last sweep; it changed
                                      ///< since the one before
  Hypothesis all_;                    ///< these merged
  MotionNoise noise_;
  double unseen_ = 0.0;  ///< s before now, since when no return tells of a change of velocity
  bool seen_ = true;     ///< since the last prediction
};

}  // namespace chase::mapping
