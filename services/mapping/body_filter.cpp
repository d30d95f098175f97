#include "services/mapping/body_filter.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace chase::mapping {

namespace {

constexpr double kEnd = 0.05;       // m, standard deviation of a first reach to an end in view
constexpr double kReshape = 0.02;   // m/sqrt(s), random walk of the outline
constexpr double kCommon = 0.02;    // m, error of a sweep's pose, common to all reaches
constexpr double kOutlier = 0.12;   // m, a reach this far from what the others say: new outline
constexpr double kShrink = 0.03;    // share of an end no longer seen that a sweep forgets
constexpr double kDoubt = 0.05;     // m, by which a sweep doubts it before
constexpr double kKnown = 0.15;     // m, standard deviation of an end that is still known
constexpr int kSure = 12;           // points of an end that is one: two for a sweep in view,
constexpr int kMostPoints = 60;     // one off for a sweep out of view; at most
constexpr double kStretch = 0.4;    // m, by which the outline may still reach beyond it
constexpr double kMostTerm = 36.0;  // of a reach in a distance: one alone does not decide
constexpr double kSquare = 20.0;    // m, larger than any mover

}  // namespace

Eigen::Vector2d Direction(int k) {
  static const std::array<Eigen::Vector2d, kDirections> table = [] {
    std::array<Eigen::Vector2d, kDirections> t;
    for (size_t i = 0; i < t.size(); ++i) {
      const double angle = 2.0 * M_PI * static_cast<double>(i) / kDirections;
      t[i] = {std::cos(angle), std::sin(angle)};
    }
    return t;
  }();
  return table[static_cast<size_t>(k)];
}

BodyFilter::BodyFilter(const Eigen::Vector2d& center, const Reaches& seen, double speed,
                       double unseen) {
  x_.head<2>() = center;
  P_(2, 2) = P_(3, 3) = speed * speed;
  for (int k = 0; k < kDirections; ++k) {
    const Reach& reach = seen[static_cast<size_t>(k)];
    x_[4 + k] = reach.along - Direction(k).dot(center);
    P_(4 + k, 4 + k) = std::pow(reach.edge ? kEnd : unseen, 2);
  }
}

double Footprint::Excess(const Eigen::Vector2d& q, double age) const {
  const Eigen::Vector2d d = q - p + age * v;
  if (d.squaredNorm() > radius * radius) return INFINITY;
  double most = -INFINITY;
  for (int k = 0; k < kDirections; ++k) {
    const auto i = static_cast<size_t>(k);
    most = std::max(most, (Direction(k).dot(d) - reach[i]) / sigma[i]);
  }
  return most;
}

/// A change that was not confirmed by a sweep is one that may have been: same mean, its variance.
void BodyFilter::Predict(double dt, const MotionNoise& noise) {
  P_ += change_ * (Changed() - P_);
  x_.head<2>() += dt * x_.segment<2>(2);
  P_.topRows<2>() += dt * P_.middleRows<2>(2);
  P_.leftCols<2>() += dt * P_.middleCols<2>(2);
  const double q = noise.acceleration * noise.acceleration;
  for (int i = 0; i < 2; ++i) {
    P_(i, i) += 0.25 * q * std::pow(dt, 4);
    P_(i, i + 2) += 0.5 * q * std::pow(dt, 3);
    P_(i + 2, i) += 0.5 * q * std::pow(dt, 3);
    P_(i + 2, i + 2) += q * dt * dt;
  }
  P_.diagonal().tail<kDirections>().array() += kReshape * kReshape * dt;
  change_ = 1.0 - std::exp(-noise.change_rate * dt);
  change_speed_ = noise.change_speed;
  change_time_ = dt;
}

/// The covariance if the velocity changed at some time of the last step, any as likely: of the
/// place by the mean square of the time since then.
BodyFilter::Covariance BodyFilter::Changed() const {
  Covariance P = P_;
  const double q = change_speed_ * change_speed_, t = change_time_;
  for (int i = 0; i < 2; ++i) {
    P(i, i) += q * t * t / 3.0;
    P(i, i + 2) += q * t / 2.0;
    P(i + 2, i) += q * t / 2.0;
    P(i + 2, i + 2) += q;
  }
  return P;
}

Footprint BodyFilter::Expected(double sigma, double most) const {
  Footprint f;
  f.p = p();
  f.v = v();
  const Covariance P = Changed();
  for (int k = 0; k < kDirections; ++k) {
    const auto i = static_cast<size_t>(k);
    const Row row = Model(k, 0.0);
    f.reach[i] = x_[4 + k];
    f.sigma[i] = std::min(most, std::sqrt(row.dot(P * row.transpose()) + sigma * sigma));
    f.radius = std::max(f.radius, std::abs(f.reach[i]) + 4.0 * f.sigma[i]);
  }
  f.radius *= 1.1;  // corners between two directions
  return f;
}

BodyFilter::Row BodyFilter::Model(int k, double age) {
  Row row = Row::Zero();
  row.head<2>() = Direction(k).transpose();
  row.segment<2>(2) = -age * Direction(k).transpose();
  row[4 + k] = 1.0;
  return row;
}

/// Ends that moved otherwise than the rest did, by a robust fit (Geman and McClure), tell of
/// another outline, not of another motion: their reaches are doubted. Returns how many of those
/// known before did move as the rest.
int BodyFilter::Reshape(const Reaches& seen, const std::array<double, kDirections>& innovation) {
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();
  for (int round = 0; round < 8; ++round) {
    Eigen::Matrix2d a = 1e-3 * Eigen::Matrix2d::Identity();
    Eigen::Vector2d b = Eigen::Vector2d::Zero();
    for (int k = 0; k < kDirections; ++k) {
      const size_t i = static_cast<size_t>(k);
      if (!seen[i].edge) continue;
      const Eigen::Vector2d d = Direction(k);
      const double rest = (innovation[i] - d.dot(shift)) / kOutlier;
      const double doubt = P_(4 + k, 4 + k) / (kOutlier * kOutlier);
      const double weight = 1.0 / (std::pow(1.0 + rest * rest, 2) * (1.0 + doubt));
      a += weight * d * d.transpose();
      b += weight * innovation[i] * d;
    }
    shift = a.inverse() * b;
  }
  int rigid = 0;
  for (int k = 0; k < kDirections; ++k) {
    const size_t i = static_cast<size_t>(k);
    if (!seen[i].edge) continue;
    const double rest = innovation[i] - Direction(k).dot(shift);
    if (std::abs(rest) > kOutlier)
      P_(4 + k, 4 + k) += rest * rest;
    else
      rigid += P_(4 + k, 4 + k) < kKnown * kKnown;
  }
  return rigid;
}

/// Where no end is in view the body reaches at least as far as it was seen. How far is anyone's
/// guess, and says nothing of the motion; hardly beyond an end that was in view often enough,
/// though: what is seen there is something else that it passes.
void BodyFilter::Uncover(const Reaches& seen, double unseen) {
  for (int k = 0; k < kDirections; ++k) {
    const Reach& reach = seen[static_cast<size_t>(k)];
    End& end = ends_[static_cast<size_t>(k)];
    if (reach.edge) {
      end = {x_[4 + k], std::min(end.points + 2, kMostPoints)};
      continue;
    }
    end.points = std::max(0, end.points - 1);
    double beyond = reach.along - Model(k, reach.age).dot(x_);
    if (end.points >= kSure)
      beyond = std::min(beyond, std::max(0.0, end.place + kStretch - x_[4 + k]));
    if (beyond <= 0.0) {  // hidden, or never was: doubted first, then forgotten slowly
      if (P_(4 + k, 4 + k) < kKnown * kKnown)
        P_(4 + k, 4 + k) += kDoubt * kDoubt;
      else
        x_[4 + k] += kShrink * beyond;
      continue;
    }
    x_[4 + k] += beyond;
    P_.row(4 + k).setZero();
    P_.col(4 + k).setZero();
    P_(4 + k, 4 + k) = unseen * unseen;
  }
}

/// Kalman update; returns the log likelihood of the innovations z but for a constant.
double BodyFilter::Update(const Eigen::MatrixXd& model, const Eigen::VectorXd& z, double sigma,
                          State* x, Covariance* P) const {
  Eigen::MatrixXd S = model * *P * model.transpose();
  S += kCommon * kCommon * model.leftCols<2>() * model.leftCols<2>().transpose();
  S.diagonal().array() += sigma * sigma;
  const Eigen::LLT<Eigen::MatrixXd> factors(S);
  const Eigen::MatrixXd gain = factors.solve(model * *P).transpose();
  *x += gain * z;
  *P -= gain * S * gain.transpose();
  const Eigen::MatrixXd L = factors.matrixL();
  return -0.5 * z.dot(factors.solve(z)) - L.diagonal().array().log().sum();
}

Sight BodyFilter::Correct(const Reaches& seen, double sigma, double unseen) {
  std::array<double, kDirections> innovation{};
  for (int k = 0; k < kDirections; ++k) {
    const Reach& reach = seen[static_cast<size_t>(k)];
    innovation[static_cast<size_t>(k)] = reach.along - Model(k, reach.age).dot(x_);
  }
  const int rigid = Reshape(seen, innovation);
  Eigen::Matrix<double, kDirections, kStates> H;
  Eigen::Matrix<double, kDirections, 1> z;
  int n = 0;
  for (int k = 0; k < kDirections; ++k) {
    const size_t i = static_cast<size_t>(k);
    if (!seen[i].edge) continue;
    H.row(n) = Model(k, seen[i].age);
    z[n++] = innovation[i];
  }
  if (n > 0) {
    const Eigen::MatrixXd model = H.topRows(n);
    State changed = x_;
    Covariance P_changed = Changed();
    const double on = Update(model, z.head(n), sigma, &x_, &P_);
    const double off = Update(model, z.head(n), sigma, &changed, &P_changed);
    const double odds = change_ / (1.0 - change_) * std::exp(std::clamp(off - on, -60.0, 60.0));
    const double w = odds / (1.0 + odds);
    const State apart = changed - x_;
    x_ += w * apart;
    P_ += w * (P_changed - P_) + w * (1.0 - w) * apart * apart.transpose();
    P_ = (0.5 * (P_ + P_.transpose())).eval();
  }
  change_ = 0.0;
  Uncover(seen, unseen);
  return {n, rigid};
}

double BodyFilter::Distance(const Reaches& seen, double sigma, double least) const {
  double sum = 0.0;
  int n = 0;
  for (int k = 0; k < kDirections; ++k) {
    const Reach& reach = seen[static_cast<size_t>(k)];
    const Row row = Model(k, reach.age);
    const double innovation = reach.along - row.dot(x_);
    if (!reach.edge) continue;
    const double s = std::max(row.dot(P_ * row.transpose()) + sigma * sigma, least * least);
    sum += std::min(kMostTerm, innovation * innovation / s) + std::log(s / (least * least));
    ++n;
  }
  return n > 0 ? sum / n : -1.0;
}

/// A large square, cut along every reach (Sutherland and Hodgman).
Points2 BodyFilter::Outline() const {
  Points2 polygon = {
      {-kSquare, -kSquare}, {kSquare, -kSquare}, {kSquare, kSquare}, {-kSquare, kSquare}};
  for (int k = 0; k < kDirections && !polygon.empty(); ++k) {
    Points2 cut;
    const auto beyond = [&](const Eigen::Vector2d& q) { return Direction(k).dot(q) - x_[4 + k]; };
    for (size_t i = 0; i < polygon.size(); ++i) {
      const Eigen::Vector2d &a = polygon[i], &b = polygon[(i + 1) % polygon.size()];
      const double fa = beyond(a), fb = beyond(b);
      if (fa <= 0.0) cut.push_back(a);
      if ((fa <= 0.0) != (fb <= 0.0)) cut.push_back(a + fa / (fa - fb) * (b - a));
    }
    polygon = std::move(cut);
  }
  return polygon;
}

double BodyFilter::CenterVariance() const {
  double sum = 0.0;
  for (int axis = 0; axis < 2; ++axis) {
    Row row = Row::Zero();
    row[axis] = 1.0;
    row[4 + axis * kDirections / 4] = 0.5;
    row[4 + axis * kDirections / 4 + kDirections / 2] = -0.5;
    sum += row.dot(P_ * row.transpose());
  }
  return 0.5 * sum;
}

double BodyFilter::VelocityVariance() const {
  return 0.5 * (P_(2, 2) + P_(3, 3)) + change_ * change_speed_ * change_speed_;
}

}  // namespace chase::mapping
