#include "deploy/calibrate/imu_fit.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>

#include "common/math/rotation.h"

namespace chase::calibrate {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using Matrix7d = Eigen::Matrix<double, 7, 7>;
using Vector7d = Eigen::Matrix<double, 7, 1>;  // rotation about C, delay, bias

// s between the two images of a turn, whose length counts against the noise of each; hands turn
// there and back in about a second.
constexpr double kSpans[] = {0.4, 0.8, 1.2}, kLate = 0.2;
constexpr double kMostGap = 0.05;  // s between samples of the gyro
constexpr double kMostDelay = 0.2, kDelayStep = 0.01;
constexpr std::size_t kLeastTurns = 120;
constexpr double kLeastTurn = 0.05;  // rad rms about the second axis
constexpr double kAdvised = 20.0;    // s of recording, and degrees to turn by: more than is needed
constexpr int kSteps = 15;
constexpr double kLastStep = 1e-4;  // rad, s, rad/s: below the sigmas
constexpr double kHuber = 2.5;      // of the median's deviation
constexpr double kBump = 1e-5;      // of differences: rad, s, rad/s
constexpr double kOverlap = 6.0;    // turns that an image belongs to, all of one error at the worst

struct Turn {
  double from, to;  // s
  Quaterniond R_C;
};

std::vector<Turn> TurnsOf(const std::vector<Turned>& seen) {
  std::vector<Turn> turns;
  for (const double span : kSpans)
    for (std::size_t i = 0, j = 0; i < seen.size(); ++i) {
      while (j < seen.size() && seen[j].t - seen[i].t < span) ++j;
      if (j < seen.size() && seen[j].t - seen[i].t <= span + kLate)
        turns.push_back({seen[i].t, seen[j].t, seen[i].R_CP * seen[j].R_CP.conjugate()});
    }
  return turns;
}

/// The gyro's rotation since its first sample, without a bias.
class Integral {
 public:
  Integral(const std::vector<Gyro>& gyro, const Vector3d& bias) : gyro_(gyro) {
    Quaterniond R = Quaterniond::Identity();
    for (std::size_t k = 0; k < gyro.size(); ++k) {
      if (k > 0) {
        const Vector3d mean = 0.5 * (gyro[k - 1].w_WB_B + gyro[k].w_WB_B) - bias;
        R = (R * math::ExpSO3(mean * (gyro[k].t - gyro[k - 1].t))).normalized();
      }
      R_.push_back(R);
    }
  }
  /// From one time to another; nothing where it has a gap.
  std::optional<Quaterniond> Between(double from, double to) const {
    const auto a = At(from), b = At(to);
    if (!a || !b) return std::nullopt;
    return a->conjugate() * *b;
  }

 private:
  std::optional<Quaterniond> At(double t) const {
    const auto after = std::lower_bound(gyro_.begin(), gyro_.end(), t,
                                        [](const Gyro& g, double at) { return g.t < at; });
    if (after == gyro_.begin() || after == gyro_.end()) return std::nullopt;
    const auto k = static_cast<std::size_t>(after - gyro_.begin());
    const double span = gyro_[k].t - gyro_[k - 1].t;
    if (span > kMostGap) return std::nullopt;
    return R_[k - 1].slerp((t - gyro_[k - 1].t) / span, R_[k]);
  }

  const std::vector<Gyro>& gyro_;
  std::vector<Quaterniond> R_;
};

struct Unknowns {
  Quaterniond R_BC = Quaterniond::Identity();
  double delay = 0.0;
  Vector3d bias = Vector3d::Zero();

  Unknowns Changed(const Vector7d& by) const {
    return {(R_BC * math::ExpSO3(by.head<3>())).normalized(), delay + by[3], bias + by.tail<3>()};
  }
};

/// A turn of C by the gyro; nothing where it has a gap.
std::optional<Quaterniond> ByGyro(const Turn& turn, const Integral& integral, const Unknowns& x) {
  const auto R_B = integral.Between(turn.from - x.delay, turn.to - x.delay);
  if (!R_B) return std::nullopt;
  return x.R_BC.conjugate() * *R_B * x.R_BC;
}

/// What the camera's turns differ by from the gyro's, in C; NaN where the gyro has a gap.
std::vector<Vector3d> Residuals(const std::vector<Turn>& turns, const std::vector<Gyro>& gyro,
                                const Unknowns& x) {
  const Integral integral(gyro, x.bias);
  std::vector<Vector3d> residuals;
  for (const Turn& turn : turns) {
    const auto R_C = ByGyro(turn, integral, x);
    residuals.push_back(R_C ? math::LogSO3(turn.R_C.conjugate() * *R_C) : Vector3d::Constant(NAN));
  }
  return residuals;
}

std::vector<ComparedTurn> Compare(const std::vector<Turn>& turns, const std::vector<Gyro>& gyro,
                                  const Unknowns& x) {
  const Integral integral(gyro, x.bias);
  std::vector<ComparedTurn> compared;
  for (const Turn& turn : turns) {
    if (turn.to - turn.from > kSpans[0] + kLate) break;  // those of the next span
    if (const auto R_C = ByGyro(turn, integral, x))
      compared.push_back({0.5 * (turn.from + turn.to), math::LogSO3(turn.R_C), math::LogSO3(*R_C)});
  }
  return compared;
}

/// The delay at which both turn by angles most alike, whatever the rotation between them.
double CoarseDelay(const std::vector<Turn>& turns, const Integral& integral) {
  double best = 0.0, least = INFINITY;
  for (double delay = -kMostDelay; delay <= kMostDelay; delay += kDelayStep) {
    double squares = 0.0, n = 0.0;
    for (const Turn& turn : turns)
      if (const auto R_B = integral.Between(turn.from - delay, turn.to - delay)) {
        squares += std::pow(math::LogSO3(*R_B).norm() - math::LogSO3(turn.R_C).norm(), 2);
        ++n;
      }
    if (n > 0.0 && squares / n < least) least = squares / n, best = delay;
  }
  return best;
}

/// v_B = R_BC v_C (Kabsch 1976).
Quaterniond CoarseRotation(const std::vector<Turn>& turns, const Integral& integral, double delay) {
  Matrix3d sum = Matrix3d::Zero();
  for (const Turn& turn : turns)
    if (const auto R_B = integral.Between(turn.from - delay, turn.to - delay))
      sum += math::LogSO3(*R_B) * math::LogSO3(turn.R_C).transpose();
  const Eigen::JacobiSVD<Matrix3d> svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const double sign = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  return Quaterniond(
      Matrix3d(svd.matrixU() * Vector3d(1.0, 1.0, sign).asDiagonal() * svd.matrixV().transpose()));
}

std::string Problem(const std::vector<Turn>& turns) {
  if (turns.size() < kLeastTurns)
    return fmt::format(
        "the board is seen in {} turns of {:g} to {:g} s, and {} are needed; keep it in view for "
        "{:g} s",
        turns.size(), *std::begin(kSpans), *std::rbegin(kSpans) + kLate, kLeastTurns, kAdvised);
  Matrix3d squares = Matrix3d::Zero();
  for (const Turn& turn : turns) {
    const Vector3d v = math::LogSO3(turn.R_C);
    squares += v * v.transpose() / static_cast<double>(turns.size());
  }
  const double second = Eigen::SelfAdjointEigenSolver<Matrix3d>(squares).eigenvalues()[1];
  if (second >= kLeastTurn * kLeastTurn) return "";
  return fmt::format(
      "it turns about one axis at the most; roll, pitch and yaw it by {:g} degrees and more, once "
      "a second",
      kAdvised);
}

/// Why the steps' result is none: `last` of them.
std::string Problem(const Unknowns& x, const Vector7d& last) {
  if (!(last.array().abs() < kLastStep).all())
    return fmt::format(
        "rotation and delay do not settle: the last of {} steps turns by {:.2g} degrees and shifts "
        "by {:.2g} ms; turn more, with the board still and in view",
        kSteps, last.head<3>().norm() * 180.0 / M_PI, 1e3 * last[3]);
  if (std::abs(x.delay) > kMostDelay)
    return fmt::format(
        "the stamps of images would be {:.0f} ms late, and {:.0f} ms either way are searched: "
        "check both clocks, bring camera.yaml's stamp_delay nearer and record again",
        1e3 * x.delay, 1e3 * kMostDelay);
  return "";
}

struct Normal {
  Matrix7d H = Matrix7d::Zero();
  Vector7d g = Vector7d::Zero();
  double squares = 0.0, n = 0.0;  // weighed
};

Normal Linearised(const std::vector<Turn>& turns, const std::vector<Gyro>& gyro,
                  const Unknowns& x) {
  const std::vector<Vector3d> r = Residuals(turns, gyro, x);
  std::vector<std::vector<Vector3d>> bumped;
  for (int i = 0; i < 7; ++i)
    bumped.push_back(Residuals(turns, gyro, x.Changed(kBump * Vector7d::Unit(i))));
  std::vector<double> norms;
  for (const Vector3d& one : r)
    if (one.allFinite()) norms.push_back(one.norm());
  Normal sum;
  if (norms.empty()) return sum;
  std::nth_element(norms.begin(), norms.begin() + static_cast<long>(norms.size() / 2), norms.end());
  const double most = kHuber * norms[norms.size() / 2] + 1e-9;
  for (std::size_t k = 0; k < r.size(); ++k) {
    Eigen::Matrix<double, 3, 7> J;
    for (int i = 0; i < 7; ++i) J.col(i) = (bumped[static_cast<std::size_t>(i)][k] - r[k]) / kBump;
    if (!r[k].allFinite() || !J.allFinite()) continue;
    const double weight = std::min(1.0, most / r[k].norm());
    sum.H += weight * J.transpose() * J;
    sum.g += weight * J.transpose() * r[k];
    sum.squares += weight * r[k].squaredNorm();
    sum.n += 1.0;
  }
  return sum;
}

}  // namespace

ImuFit FitImu(const std::vector<Turned>& seen, const std::vector<Gyro>& gyro) {
  ImuFit fit;
  const std::vector<Turn> turns = TurnsOf(seen);
  fit.problem = Problem(turns);
  if (!fit.problem.empty()) return fit;
  const Integral integral(gyro, Vector3d::Zero());
  Unknowns x;
  x.delay = CoarseDelay(turns, integral);
  x.R_BC = CoarseRotation(turns, integral, x.delay);
  Normal sum;
  Vector7d last = Vector7d::Zero();
  for (int step = 0; step < kSteps; ++step) {
    sum = Linearised(turns, gyro, x);
    if (sum.n < static_cast<double>(kLeastTurns)) {
      fit.problem = "IMU covers few of the turns; record IMU and CAMERA_IMAGE together";
      return fit;
    }
    last = -sum.H.ldlt().solve(sum.g);
    x = x.Changed(last);
  }
  fit.problem = Problem(x, last);
  if (!fit.problem.empty()) return fit;
  sum = Linearised(turns, gyro, x);
  const double variance = sum.squares / (3.0 * sum.n - 7.0);
  const Vector7d sigmas = (kOverlap * variance * sum.H.inverse()).diagonal().cwiseSqrt();
  fit.R_BC = x.R_BC, fit.delay = x.delay, fit.bias = x.bias;
  fit.rms = std::sqrt(variance);
  fit.rotation_sigma = sigmas.head<3>();
  fit.delay_sigma = sigmas[3];
  fit.turns = static_cast<int>(sum.n);
  fit.compared = Compare(turns, gyro, x);
  return fit;
}

}  // namespace chase::calibrate
