#pragma once

#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "logs/src/flight_record.h"

/// What maps show from above, frame W.
namespace chase::logs {

using Outline = std::vector<Eigen::Vector2d>;  ///< a closed polygon or an open path, m

/// Parts an open path: nothing is drawn to it or from it.
inline const Eigen::Vector2d kBreak = Eigen::Vector2d::Constant(std::nan(""));

/// Passes the first item and then each that is at least `step` later than the last passed.
class Thinner {
 public:
  explicit Thinner(double step) : step_(step) {}
  bool Pass(double t) {
    if (t < next_) return false;
    next_ = t + step_ - 1e-6;
    return true;
  }

 private:
  double step_, next_ = -1e300;
};

/// Trajectories, thinned to one every half second.
class Fan {
 public:
  void Add(double t, const world::Trajectory& trajectory);
  const std::vector<Outline>& outlines() const { return outlines_; }

 private:
  static constexpr double kStep = 0.5;  // s
  Thinner thinner_{kStep};
  std::vector<Outline> outlines_;
};

/// The unit circle under the linear map A, about c.
Outline Ellipse(const Eigen::Vector2d& c, const Eigen::Matrix2d& A);

/// Shadows of ellipsoids on the ground.
std::vector<Outline> Shadows(const std::vector<PerceivedObstacle>& obstacles);

/// {x: [...], y: [...]}, to the millimetre, null for a break; `closed` repeats the first point at
/// the end.
nlohmann::ordered_json Points(const Outline& outline, bool closed);
nlohmann::ordered_json Points(const std::vector<Outline>& outlines, bool closed);

}  // namespace chase::logs
