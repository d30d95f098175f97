#include "logs/src/settled_flight.h"

#include <algorithm>

#include "logs/src/fits.h"

namespace chase::logs {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

constexpr double kSettling = 0.5;     // s after a gap until the lags have forgotten it
constexpr double kLeastFlight = 5.0;  // s: ten times the settling, 25 times a lag of 0.2 s
constexpr double kHeld = 0.1;         // s: setpoints further apart are held, not interpolated
constexpr double kBlock = 10.0;       // s
constexpr double kWander = 0.01;      // m/s^2 that a bias, as odometry knows it, is off at times
constexpr Index kMostBlocks = 20;

/// Median time from one to the next; 0: there are no two.
template <class T>
double MedianPeriod(const std::vector<T>& stamped) {
  std::vector<double> periods;
  for (size_t i = 1; i < stamped.size(); ++i) periods.push_back(stamped[i].t - stamped[i - 1].t);
  if (periods.empty()) return 0.0;
  const auto middle = periods.begin() + static_cast<std::ptrdiff_t>(periods.size() / 2);
  std::nth_element(periods.begin(), middle, periods.end());
  return *middle;
}

}  // namespace

SettledFlight::SettledFlight(const FlightSamples& flight)
    : flight_(flight),
      period_(MedianPeriod(flight.motions)),
      hold_(MedianPeriod(flight.asked) / std::sqrt(12.0)) {
  double begun = 0.0;
  const Motion* last = nullptr;
  for (size_t i = 0; i < flight.motions.size(); ++i) {
    const Motion& m = flight.motions[i];
    if (i == 0 || m.stretch != flight.motions[i - 1].stretch) begun = m.t;
    if (m.t - begun < kSettling) continue;
    if (last && last->stretch == m.stretch) seconds_ += m.t - last->t;
    settled_.push_back(i);
    last = &m;
  }
}

bool SettledFlight::Suffices() const { return seconds_ >= kLeastFlight && !flight_.asked.empty(); }

Vector3d SettledFlight::Velocity(Index k) const { return at(k).R_WB.conjugate() * at(k).v_WB; }

Vector3d SettledFlight::Speeds() const {
  Vector3d squares = Vector3d::Zero();
  for (Index k = 0; k < size(); ++k) squares += Velocity(k).cwiseAbs2();
  return (squares / static_cast<double>(size())).cwiseSqrt();
}

void SettledFlight::AddVelocityDoubt(int axis, Parameter* drag) const {
  const double speed = Speeds()[axis];
  double variance = 0.0;
  for (Index k = 0; k < size(); ++k) variance += at(k).velocity_covariance(axis, axis);
  const double sigma = std::sqrt(variance / static_cast<double>(size()));
  if (!(speed > 0.0))
    *drag = {};
  else
    *drag = WithSystematic(*drag, drag->value * sigma / speed);
}

Asked SettledFlight::AskedAt(double t) const {
  const auto after = std::upper_bound(flight_.asked.begin(), flight_.asked.end(), t,
                                      [](double time, const Asked& a) { return time < a.t; });
  if (after == flight_.asked.begin()) return flight_.asked.front();
  const Asked& a = *(after - 1);
  if (after == flight_.asked.end() || after->t - a.t > kHeld) return a;
  const double share = (t - a.t) / (after->t - a.t);
  return {t, a.R_WB.slerp(share, after->R_WB), a.w_WB_B + share * (after->w_WB_B - a.w_WB_B),
          a.thrust + share * (after->thrust - a.thrust)};
}

Regression SettledFlight::Empty(int rows, const std::vector<double>& prior) const {
  Regression r;
  const auto p = static_cast<Index>(prior.size());
  r.X = Eigen::MatrixXd::Zero(size() * rows, p);
  r.y = Eigen::VectorXd::Zero(size() * rows);
  r.prior = Eigen::Map<const Eigen::VectorXd>(prior.data(), p);
  r.rows = rows;
  return r;
}

void SettledFlight::AddWander(Regression* r) const {
  const auto blocks = std::clamp<Index>(std::lround(seconds_ / kBlock), 1, kMostBlocks);
  const Index p = r->X.cols();
  r->X.conservativeResize(Eigen::NoChange, p + blocks * r->rows);
  r->X.rightCols(blocks * r->rows).setZero();
  for (Index row = 0; row < r->X.rows(); ++row)
    r->X(row, p + (row / r->rows) * blocks / size() * r->rows + row % r->rows) = 1.0;
  r->prior.conservativeResize(r->X.cols());
  r->prior.tail(blocks * r->rows).setConstant(kWander);
}

}  // namespace chase::logs
