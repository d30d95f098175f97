#include "services/prediction/steady_motion.h"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdio>
#include <limits>

namespace chase::prediction {
namespace {

using Complex = std::complex<double>;

constexpr int kTurns = 8;       // turn rates to either side of straight on
constexpr double kReach = 3.0;  // the fastest, in `turn_sigma`
// Change of speed per speed now, 1/s: steady, slowing down to rest after 4 to 0.5 s, speeding up
// since as long.
constexpr double kChanges[] = {0.0, -0.25, -0.42, -0.7, -1.2, -2.0, 0.25, 0.7, 2.0};
constexpr int kSlowing = 5, kGaining = 3;
constexpr int kFewest = 3;            // observations that a motion is told from
constexpr int kSamples = 24;          // of the way ahead, that the polynomial is fitted to
constexpr double kNegligible = 1e-9;  // of the likeliest hypothesis

// Displacement per velocity at time 0 after t s of turning at w rad/s, with the speed growing by
// `change` of itself a second: the integral of (1 + change s) e^{iws} from 0 to t.
Complex Arc(double w, double change, double t) {
  if (std::abs(w * t) < 1e-3) {
    const double linear = 0.5 * change * t * t;
    return {t + linear, w * t * (0.5 * t + change * t * t / 3.0)};
  }
  const Complex turned = std::polar(1.0, w * t), iw(0.0, w);
  return (turned * (1.0 + change * t) - 1.0 - change * (turned - 1.0) / iw) / iw;
}

// Of a target that stood before it began to speed up.
double Since(double change, double t) { return change > 0.0 ? std::max(t, -1.0 / change) : t; }

// One observation in the plane, about an origin near by.
struct Seen {
  double t;
  Complex x;
  double z, weight, z_weight;  // 1/m^2
};

std::vector<Seen> NewestFirst(const std::vector<Observation>& observations, double now,
                              double sigma_floor, const Eigen::Vector3d& origin) {
  const double least = sigma_floor * sigma_floor;
  std::vector<Seen> seen;
  for (auto o = observations.rbegin(); o != observations.rend(); ++o) {
    const Eigen::Vector3d x = o->mean - origin;
    const double plane = 0.5 * (o->covariance(0, 0) + o->covariance(1, 1));
    seen.push_back({o->t - now,
                    {x.x(), x.y()},
                    x.z(),
                    1.0 / std::max(least, plane),
                    1.0 / std::max(least, o->covariance(2, 2))});
  }
  return seen;
}

// Weighted least squares for x0 + v0 e(t): running sums, the least sum of squares of what is left.
template <class T>
class RunningFit {
 public:
  explicit RunningFit(double speed_scale) : ee_(1.0 / (speed_scale * speed_scale)) {}
  void Add(double weight, const T& e, const T& x) {
    w_ += weight, e_ += weight * e, ee_ += weight * std::norm(e);
    x_ += weight * x, ex_ += weight * Conjugate(e) * x, xx_ += weight * std::norm(x);
  }
  double Solve(T* x0, T* v0) const {
    const double determinant = w_ * ee_ - std::norm(e_);  // > 0: ee_ starts above zero
    *x0 = (ee_ * x_ - e_ * ex_) / determinant;
    *v0 = (w_ * ex_ - Conjugate(e_) * x_) / determinant;
    return std::max(0.0, xx_ - std::real(Conjugate(*x0) * x_ + Conjugate(*v0) * ex_));
  }

 private:
  static double Conjugate(double x) { return x; }
  static Complex Conjugate(const Complex& x) { return std::conj(x); }
  double w_ = 0.0;
  T e_{};
  double ee_;
  T x_{}, ex_{};
  double xx_ = 0.0;
};

constexpr size_t kRates = std::size(kChanges);
constexpr size_t kMotions = (2 * kTurns + 1) * kRates;

// A turn rate with a change of speed.
struct Motion {
  int turn;
  size_t change;
  size_t index() const { return static_cast<size_t>(turn + kTurns) * kRates + change; }
};

// A motion since one of the observations, with the best fit.
struct Hypothesis {
  double log_likelihood;
  Motion motion;
  Complex x0, v0;
  double z0, vz;
};

double TurnRate(const MotionConfig& config, int turn) {
  return turn * kReach * config.turn_sigma / kTurns;
}

double LogPrior(const MotionConfig& config, const Motion& motion) {
  const double change = kChanges[motion.change];
  const double speed = change < 0.0   ? config.slowing_share / kSlowing
                       : change > 0.0 ? config.gaining_share / kGaining
                                      : 1.0 - config.slowing_share - config.gaining_share;
  if (motion.turn == 0) return std::log(config.straight_share * speed);
  const double in_sigmas = motion.turn * kReach / kTurns;
  const double density = std::exp(-0.5 * in_sigmas * in_sigmas) / std::sqrt(2.0 * M_PI);
  return std::log((1.0 - config.straight_share) * density * kReach / kTurns * speed);
}

void AddHypotheses(const MotionConfig& config, const std::vector<Seen>& seen, double speed_scale,
                   const Motion& motion, std::vector<Hypothesis>* all) {
  const int count = static_cast<int>(seen.size());
  const double rate = TurnRate(config, motion.turn), change = kChanges[motion.change];
  const double prior = LogPrior(config, motion);
  RunningFit<Complex> plane(speed_scale);
  RunningFit<double> height(speed_scale);
  for (int i = 0; i < count; ++i) {
    const Seen& s = seen[static_cast<size_t>(i)];
    plane.Add(s.weight, Arc(rate, change, Since(change, s.t)), s.x);
    height.Add(s.z_weight, s.t, s.z);
    if (i + 1 < std::min(count, kFewest)) continue;
    Hypothesis h{prior - config.change_cost * (count - 1 - i), motion, {}, {}, 0.0, 0.0};
    h.log_likelihood -= 0.5 * plane.Solve(&h.x0, &h.v0);
    height.Solve(&h.z0, &h.vz);
    all->push_back(h);
  }
}

std::vector<Hypothesis> Hypotheses(const MotionConfig& config, const std::vector<Seen>& seen,
                                   double speed_scale) {
  std::vector<Hypothesis> all;
  for (int turn = -kTurns; turn <= kTurns; ++turn)
    for (size_t change = 0; change < kRates; ++change)
      AddHypotheses(config, seen, speed_scale, {turn, change}, &all);
  return all;
}

// Speed per speed now, t s ahead: who slows down comes to rest, who gains goes on for a while.
double SpeedAhead(const MotionConfig& config, double change, double t) {
  if (change <= 0.0) return std::max(0.0, 1.0 + change * t);
  return 1.0 + change * config.gain_memory * (1.0 - std::exp(-t / config.gain_memory));
}

// Fits c_1 tau + c_2 tau^2 + ... to the way ahead per velocity, for turn rates of 0 and above.
class WaysAhead {
 public:
  WaysAhead(const MotionConfig& config, double horizon, int rows) {
    Eigen::MatrixXd powers(kSamples, rows - 1);
    for (int i = 0; i < kSamples; ++i)
      for (int k = 0; k < rows - 1; ++k) powers(i, k) = std::pow((i + 1.0) / kSamples, k + 1.0);
    Eigen::MatrixXd ways(kSamples, 2 * (kTurns + 1) * kRates);
    for (int turn = 0; turn <= kTurns; ++turn) {
      std::array<Complex, kRates> way{};
      for (int i = 0; i < kSamples; ++i) {
        const double t = (i + 0.5) * horizon / kSamples;
        const double turned =
            TurnRate(config, turn) * config.turn_memory * (1.0 - std::exp(-t / config.turn_memory));
        const Complex step = std::polar(horizon / kSamples, turned);
        for (size_t change = 0; change < kRates; ++change) {
          way[change] += SpeedAhead(config, kChanges[change], t) * step;
          ways(i, Column({turn, change})) = way[change].real();
          ways(i, Column({turn, change}) + 1) = way[change].imag();
        }
      }
    }
    fitted_ = powers.householderQr().solve(ways);
  }
  /// Of tau^(k + 1).
  Complex Coefficient(const Motion& motion, int k) const {
    const auto column = Column(motion);
    return {fitted_(k, column), motion.turn < 0 ? -fitted_(k, column + 1) : fitted_(k, column + 1)};
  }

 private:
  static Eigen::Index Column(const Motion& motion) {
    return 2 * (std::abs(motion.turn) * static_cast<Eigen::Index>(kRates) +
                static_cast<Eigen::Index>(motion.change));
  }
  Eigen::MatrixXd fitted_;
};

}  // namespace

std::string MotionConfig::Problem() const {
  const struct {
    const char* field;
    double value, low, high;
  } limits[] = {
      {"turn_sigma", turn_sigma, 1e-3, 100},        {"straight_share", straight_share, 1e-6, 1},
      {"turn_memory", turn_memory, 1e-2, 1e3},      {"slowing_share", slowing_share, 1e-6, 0.45},
      {"gaining_share", gaining_share, 1e-6, 0.45}, {"gain_memory", gain_memory, 1e-2, 1e3},
      {"change_cost", change_cost, 0, 1e6},         {"sigma_floor", sigma_floor, 1e-4, 10}};
  for (const auto& limit : limits) {
    if (std::isfinite(limit.value) && limit.value >= limit.low && limit.value <= limit.high)
      continue;
    char text[160];
    std::snprintf(text, sizeof text, "%s: %g is not within %g to %g", limit.field, limit.value,
                  limit.low, limit.high);
    return text;
  }
  return "";
}

Eigen::Matrix<double, Eigen::Dynamic, 3> SteadyForecast(
    const MotionConfig& config, const std::vector<Observation>& observations, double now,
    double horizon, int rows, double speed_scale) {
  const Eigen::Vector3d origin = observations.back().mean;
  const auto hypotheses =
      Hypotheses(config, NewestFirst(observations, now, config.sigma_floor, origin), speed_scale);
  double best = -std::numeric_limits<double>::infinity();
  for (const Hypothesis& h : hypotheses) best = std::max(best, h.log_likelihood);
  double sum = 0.0, z0 = 0.0, vz = 0.0;
  Complex x0{};
  std::array<Complex, kMotions> v0{};
  for (const Hypothesis& h : hypotheses) {
    const double weight = std::exp(h.log_likelihood - best);
    if (!(weight > kNegligible)) continue;
    sum += weight, x0 += weight * h.x0, z0 += weight * h.z0, vz += weight * h.vz;
    v0[h.motion.index()] += weight * h.v0;
  }
  Eigen::Matrix<double, Eigen::Dynamic, 3> q = Eigen::MatrixXd::Zero(rows, 3);
  q.row(0) << x0.real() / sum, x0.imag() / sum, z0 / sum;
  q(1, 2) = horizon * vz / sum;
  const WaysAhead ways(config, horizon, rows);
  for (int k = 1; k < rows; ++k) {
    Complex c{};
    for (int turn = -kTurns; turn <= kTurns; ++turn)
      for (size_t change = 0; change < kRates; ++change)
        c += v0[Motion{turn, change}.index()] * ways.Coefficient({turn, change}, k - 1);
    q(k, 0) = c.real() / sum;
    q(k, 1) = c.imag() / sum;
  }
  q.row(0) += origin.transpose();
  return q;
}

}  // namespace chase::prediction
