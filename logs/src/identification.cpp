#include "logs/src/identification.h"

#include <algorithm>
#include <cmath>

#include "logs/src/lagged_response.h"

namespace chase::logs {
namespace {

using Eigen::Index;
using Eigen::Vector3d;

constexpr double kGravity = 9.81;  // m/s^2
constexpr double kSettling = 0.5;  // s after a gap until the lags have forgotten it
constexpr double kHeld = 0.1;      // s: setpoints further apart are held, not interpolated
constexpr double kBlock = 10.0;    // s
constexpr Index kMostBlocks = 20;
constexpr int kRounds = 2;            // of thrust and vertical drag, each by the other
constexpr int kGustMemory = 20;       // instants, 0.1 s at 200 Hz: gusts beneath white noise
constexpr double kHold = 0.0014;      // s: setpoints are held for 5 ms, from a time unknown in it
constexpr double kLeastFlight = 5.0;  // s: ten times the settling, 25 times a lag of 0.2 s
// Known beforehand, standard deviations.
constexpr double kDrag = 5.0;        // 1/s, control's bound
constexpr double kWind = 3.0;        // m/s^2: 10 m/s at 0.3 1/s
constexpr double kAccelBias = 0.05;  // m/s^2: a small MEMS unit's at power-on (ImuConfig)
constexpr double kWander = 0.01;     // m/s^2 that this bias, as odometry knows it, is off at times
constexpr double kGyroBias = 0.05;   // rad/s: 3 degrees/s
constexpr double kGain = 10.0;       // of thrusts, 1; of attitude, 1/s: twice what PX4 has
constexpr double kShare = 1.0;       // of rates fed forward: none or all

Parameter At(const Solution& s, Index i) { return {s.value[i], std::sqrt(s.covariance(i, i))}; }

/// Of what is `value` and changes by `slopes` with the coefficients.
Parameter Derived(const Solution& s, double value, const Eigen::VectorXd& slopes) {
  return {value, std::sqrt(slopes.dot(s.covariance * slopes))};
}

/// Lag and delay in one, which data tell better than each alone.
Parameter LastTwo(const Solution& s) {
  return {s.value.tail<2>().sum(),
          std::hypot(kHold, std::sqrt(s.covariance.bottomRightCorner<2, 2>().sum()))};
}

class Identifier {
 public:
  explicit Identifier(const FlightSamples& flight) : flight_(flight) {
    double begun = 0.0;
    for (size_t i = 0; i < flight.motions.size(); ++i) {
      const Motion& m = flight.motions[i];
      if (i == 0 || m.stretch != flight.motions[i - 1].stretch) begun = m.t;
      if (m.t - begun >= kSettling) settled_.push_back(i);
    }
    seconds_ = Seconds();
  }

  std::optional<Identification> Result() const {
    if (seconds_ < kLeastFlight || flight_.asked.empty()) return std::nullopt;
    Identification result;
    result.seconds = seconds_;
    result.speeds = Speeds();
    const Vector3d wind = FindDrag(&result);
    FindThrust(wind, &result);
    FindAttitude(&result);
    return result;
  }

 private:
  double Seconds() const {
    double sum = 0.0;
    for (size_t k = 1; k < settled_.size(); ++k) {
      const Motion &a = flight_.motions[settled_[k - 1]], &b = flight_.motions[settled_[k]];
      if (a.stretch == b.stretch) sum += b.t - a.t;
    }
    return sum;
  }

  /// Root mean squares.
  Vector3d Speeds() const {
    Vector3d squares = Vector3d::Zero();
    for (const size_t i : settled_) squares += Velocity(i).cwiseAbs2();
    return (squares / static_cast<double>(settled_.size())).cwiseSqrt();
  }

  /// Adds what a velocity does to the drag along an axis that is off as odometry says it may be,
  /// at worst all the time in proportion.
  void Doubt(int axis, Index i, Solution* s) const {
    double squares = 0.0;
    for (const size_t k : settled_) squares += std::pow(flight_.motions[k].velocity_sigma, 2);
    const double sigma = std::sqrt(squares / static_cast<double>(settled_.size()));
    s->covariance(i, i) += std::pow(s->value[i] * sigma / Speeds()[axis], 2);
  }

  Vector3d Velocity(size_t i) const {
    const Motion& m = flight_.motions[i];
    return m.R_WB.conjugate() * m.v_WB;
  }

  Asked AskedAt(double t) const {
    const auto after = std::upper_bound(flight_.asked.begin(), flight_.asked.end(), t,
                                        [](double time, const Asked& a) { return time < a.t; });
    if (after == flight_.asked.begin()) return flight_.asked.front();
    const Asked& a = *(after - 1);
    if (after == flight_.asked.end() || after->t - a.t > kHeld) return a;
    const double share = (t - a.t) / (after->t - a.t);
    return {t, a.R_WB.slerp(share, after->R_WB), a.w_WB_B + share * (after->w_WB_B - a.w_WB_B),
            a.thrust + share * (after->thrust - a.thrust)};
  }

  /// What `signal` of motion and setpoint gives through the lags, at each motion.
  template <int N, class Signal>
  std::vector<Eigen::Matrix<double, N, 1>> Through(const Lags& lags, const Signal& signal) const {
    std::vector<Eigen::Matrix<double, N, 1>> out;
    out.reserve(flight_.motions.size());
    Eigen::Matrix<double, N, 1> last = Eigen::Matrix<double, N, 1>::Zero(), state = last;
    const Motion* before = nullptr;
    for (const Motion& m : flight_.motions) {
      const Eigen::Matrix<double, N, 1> now = signal(m, AskedAt(m.t - lags.delay));
      if (!before || before->stretch != m.stretch)
        state = now;
      else
        state += (1.0 - std::exp((before->t - m.t) / lags.lag)) * (0.5 * (last + now) - state);
      out.push_back(state);
      last = now;
      before = &m;
    }
    return out;
  }

  Regression Empty(int rows, const std::vector<double>& prior) const {
    Regression r;
    const auto n = static_cast<Index>(settled_.size()) * rows;
    const auto p = static_cast<Index>(prior.size());
    r.X = Eigen::MatrixXd::Zero(n, p);
    r.y = Eigen::VectorXd::Zero(n);
    r.prior = Eigen::Map<const Eigen::VectorXd>(prior.data(), p);
    r.rows = rows;
    return r;
  }

  /// Lets the bias of each axis wander: a constant more for every ten seconds. A single climb tells
  /// nothing else from it.
  void AddWander(Regression* r) const {
    const auto blocks = std::clamp<Index>(std::lround(seconds_ / kBlock), 1, kMostBlocks);
    const Index p = r->X.cols(), n = r->X.rows() / r->rows;
    r->X.conservativeResize(Eigen::NoChange, p + blocks * r->rows);
    r->X.rightCols(blocks * r->rows).setZero();
    for (Index row = 0; row < r->X.rows(); ++row)
      r->X(row, p + (row / r->rows) * blocks / n * r->rows + row % r->rows) = 1.0;
    r->prior.conservativeResize(r->X.cols());
    r->prior.tail(blocks * r->rows).setConstant(kWander);
  }

  /// The wind, where there is enough drag to tell, m/s.
  Vector3d FindDrag(Identification* result) const {
    Regression r = Empty(2, {kDrag, kDrag, kWind, kWind, kAccelBias, kAccelBias});
    for (size_t k = 0; k < settled_.size(); ++k) {
      const Motion& m = flight_.motions[settled_[k]];
      const Vector3d v = Velocity(settled_[k]);
      const Eigen::Matrix3d R_BW = m.R_WB.conjugate().toRotationMatrix();
      for (int axis = 0; axis < 2; ++axis) {
        const Index row = 2 * static_cast<Index>(k) + axis;
        r.y[row] = m.accel[axis];
        r.X(row, axis) = -v[axis];
        r.X.block<1, 2>(row, 2) = R_BW.block<1, 2>(axis, 0);
        r.X(row, 4 + axis) = 1.0;
      }
    }
    AddWander(&r);
    Solution s = Solve(r);
    for (int axis = 0; axis < 2; ++axis) Doubt(axis, axis, &s);
    result->drag_forward = At(s, 0);
    result->drag_sideways = At(s, 1);
    const Parameter drag = result->drag_horizontal = OfBoth(s);
    const double share = drag.value / (drag.value * drag.value + drag.sigma * drag.sigma);
    return share * Vector3d(s.value[2], s.value[3], 0.0);
  }

  /// The mean of both directions with the least variance. Control knows one drag for all headings:
  /// where they differ by more than they are uncertain, it is the more uncertain (Birge 1932).
  static Parameter OfBoth(const Solution& s) {
    const Eigen::Matrix2d P = s.covariance.topLeftCorner<2, 2>();
    const double difference = s.value[0] - s.value[1];
    const double variance = P(0, 0) + P(1, 1) - 2.0 * P(0, 1);
    const double share = std::clamp((P(1, 1) - P(0, 1)) / variance, 0.0, 1.0);
    const Eigen::Vector2d weights(share, 1.0 - share);
    const double ratio = std::max(1.0, std::abs(difference) / std::sqrt(variance));
    return {weights.dot(s.value.head<2>()), ratio * std::sqrt(weights.dot(P * weights))};
  }

  void FindThrust(const Vector3d& wind, Identification* result) const {
    double mean = 0.0;
    for (const size_t i : settled_) mean += AskedAt(flight_.motions[i].t).thrust;
    mean /= static_cast<double>(settled_.size());
    Parameter drag = result->drag_horizontal;
    LaggedSolution found;
    for (int i = 0; i < kRounds; ++i) {
      found = SolveLagged([&](const Lags& lags) { return Thrust(lags, mean, wind, drag.value); });
      drag = Climbing(Thrust(found.at, mean, wind, 0.0), wind, found.solution);
    }
    const Solution& s = found.solution;
    // given = u (gain + bend (u / mean - 1)) is gravity at the hover.
    const double gain = s.value[0], bend = s.value[1];
    double u = kGravity / gain;
    for (int i = 0; i < 20; ++i) u = kGravity / (gain + bend * (u / mean - 1.0));
    const double off = u / mean - 1.0, slope = gain + bend * (1.0 + 2.0 * off);  // of given
    const double scale = kGravity / u, curvature = bend * u / mean / scale;
    Eigen::VectorXd d_scale = Eigen::VectorXd::Zero(s.value.size());
    d_scale.head<2>() << 1.0, off;
    d_scale *= scale / slope;
    Eigen::VectorXd d_curvature = -2.0 * curvature / scale * d_scale;
    d_curvature[1] += u / mean / scale;
    result->thrust_scale = Derived(s, scale, d_scale);
    result->thrust_scale.sigma =
        std::hypot(result->thrust_scale.sigma, drag.sigma * Climbs(wind).mean() / u);
    result->hover_thrust = {u, u / scale * result->thrust_scale.sigma};
    result->thrust_curvature = Derived(s, curvature, d_curvature);
    result->drag_vertical = drag;
    result->thrust_lag = LastTwo(s);
  }

  /// Vertical drag from what the thrust leaves: not whitened, since the velocity's error would
  /// hide it, while the thrust has to be, since it answers to gusts.
  Parameter Climbing(const Regression& all, const Vector3d& wind, const Solution& thrust) const {
    Regression r = Empty(1, {kDrag, kWind});
    r.X << -Climbs(wind), Eigen::VectorXd::Ones(r.y.size());
    r.y = all.y - all.X.leftCols<2>() * thrust.value.head<2>();
    AddWander(&r);
    Solution s = Solve(r);
    Doubt(2, 0, &s);
    Eigen::MatrixXd information = r.X.transpose() * r.X;
    information.diagonal().array() += 1e-9 * static_cast<double>(r.X.rows());
    const Eigen::Vector2d from_thrust =
        information.ldlt().solve(r.X.transpose() * all.X.leftCols<2>()).row(0);
    const double known = from_thrust.dot(thrust.covariance.topLeftCorner<2, 2>() * from_thrust);
    return {s.value[0], std::sqrt(s.covariance(0, 0) + known)};
  }

  /// Velocities through the air along z of B: a body that leans into the wind feels it from below.
  Eigen::VectorXd Climbs(const Vector3d& wind) const {
    Eigen::VectorXd climbs(static_cast<Index>(settled_.size()));
    for (size_t k = 0; k < settled_.size(); ++k) {
      const Motion& m = flight_.motions[settled_[k]];
      climbs[static_cast<Index>(k)] = (m.R_WB.conjugate() * (m.v_WB - wind)).z();
    }
    return climbs;
  }

  Regression Thrust(const Lags& lags, double mean, const Vector3d& wind, double drag) const {
    const auto asked = Through<1>(
        lags, [](const Motion&, const Asked& a) { return Eigen::Matrix<double, 1, 1>(a.thrust); });
    Regression r = Empty(1, {kGain, kGain, kAccelBias});
    r.memory = kGustMemory;
    r.y = drag * Climbs(wind);
    for (size_t k = 0; k < settled_.size(); ++k) {
      const size_t i = settled_[k];
      const double u = asked[i][0];
      const auto row = static_cast<Index>(k);
      r.y[row] += flight_.motions[i].accel.z();
      r.X.row(row) << u, u * (u / mean - 1.0), 1.0;
    }
    return r;
  }

  void FindAttitude(Identification* result) const {
    const Solution s = SolveLagged([this](const Lags& lags) { return Attitude(lags); }).solution;
    const double gain = s.value[0], share = s.value[1];
    result->attitude_gain = At(s, 0);
    result->rate_share = At(s, 1);
    result->rate_lag = LastTwo(s);
    // (share s + gain) / (lag s^2 + s + gain) lags by (1 - share) / gain where s is small.
    Eigen::VectorXd slopes = Eigen::VectorXd::Zero(s.value.size());
    slopes[0] = -(1.0 - share) / (gain * gain);
    slopes[1] = -1.0 / gain;
    slopes[5] = 1.0;
    result->lead = Derived(s, s.value[5] + (1.0 - share) / gain, slopes);
    result->lead.sigma = std::hypot(kHold, result->lead.sigma);
  }

  /// Error of attitude about x and y of B, rad, and the rates fed forward, turned into it, rad/s.
  static Eigen::Vector4d Wanted(const Motion& m, const Asked& a) {
    Eigen::Quaterniond error = m.R_WB.conjugate() * a.R_WB;
    if (error.w() < 0.0) error.coeffs() *= -1.0;
    const Vector3d rate = error * a.w_WB_B;
    return {2.0 * error.x(), 2.0 * error.y(), rate.x(), rate.y()};
  }

  /// PX4's law: the error gives a rate, and what is fed forward comes on top.
  Regression Attitude(const Lags& lags) const {
    const auto wanted = Through<4>(lags, Wanted);
    Regression r = Empty(2, {kGain, kShare, kGyroBias, kGyroBias});
    for (size_t k = 0; k < settled_.size(); ++k) {
      const size_t i = settled_[k];
      for (int axis = 0; axis < 2; ++axis) {
        const Index row = 2 * static_cast<Index>(k) + axis;
        r.y[row] = flight_.motions[i].w_WB_B[axis];
        r.X(row, 0) = wanted[i][axis];
        r.X(row, 1) = wanted[i][2 + axis];
        r.X(row, 2 + axis) = 1.0;
      }
    }
    return r;
  }

  const FlightSamples& flight_;
  std::vector<size_t> settled_;
  double seconds_ = 0.0;
};

}  // namespace

std::optional<Identification> Identify(const FlightSamples& flight) {
  return Identifier(flight).Result();
}

}  // namespace chase::logs
