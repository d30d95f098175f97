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
  Hypothesis born;
  born.x.head<2>() = center;
  born.P(2, 2) = born.P(3, 3) = speed * speed;
  born.weight = 1.0;
  for (int k = 0; k < kDirections; ++k) {
    const Reach& reach = seen[static_cast<size_t>(k)];
    born.x[4 + k] = reach.along - Direction(k).dot(center);
    born.P(4 + k, 4 + k) = std::pow(reach.edge ? kEnd : unseen, 2);
  }
  Take(born, {});
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

BodyFilter::Hypothesis BodyFilter::Merged(const Hypothesis& a, const Hypothesis& b) {
  Hypothesis both;
  both.weight = a.weight + b.weight;
  const double w = both.weight > 0.0 ? b.weight / both.weight : 0.0;
  const State apart = b.x - a.x;
  both.x = a.x + w * apart;
  both.P = a.P + w * (b.P - a.P) + w * (1.0 - w) * apart * apart.transpose();
  both.P = (0.5 * (both.P + both.P.transpose())).eval();
  return both;
}

void BodyFilter::Take(const Hypothesis& went_on, const Hypothesis& changed) {
  ways_ = {went_on, changed};
  all_ = Merged(went_on, changed);
}

/// Probability of a change that nothing tells of yet, up to `from` s before now.
double BodyFilter::ChangeSince(double from) const {
  return 1.0 - std::exp(-noise_.change_rate * std::max(0.0, unseen_ - from));
}

/// If the velocity changed between `unseen_` and `from` s before now, any time as likely: of the
/// place by the mean square of the time since then.
BodyFilter::Hypothesis BodyFilter::Changed(const Hypothesis& before, double from) const {
  Hypothesis after = before;
  const double q = noise_.change_speed * noise_.change_speed, until = std::max(from, unseen_);
  for (int i = 0; i < 2; ++i) {
    after.P(i, i) += q * (from * from + from * until + until * until) / 3.0;
    after.P(i, i + 2) += q * (from + until) / 2.0;
    after.P(i + 2, i) += q * (from + until) / 2.0;
    after.P(i + 2, i + 2) += q;
  }
  return after;
}

/// A change that no sweep could tell of is one that may have been: same mean, its variance.
void BodyFilter::Predict(double dt, const MotionNoise& noise) {
  const double q = noise.acceleration * noise.acceleration, change = ChangeSince(0.0);
  for (auto& way : ways_) {
    auto& P = way.P;
    if (!seen_) P += change * (Changed(way, 0.0).P - P);
    way.x.head<2>() += dt * way.x.segment<2>(2);
    P.topRows<2>() += dt * P.middleRows<2>(2);
    P.leftCols<2>() += dt * P.middleCols<2>(2);
    for (int i = 0; i < 2; ++i) {
      P(i, i) += 0.25 * q * std::pow(dt, 4);
      P(i, i + 2) += 0.5 * q * std::pow(dt, 3);
      P(i + 2, i) += 0.5 * q * std::pow(dt, 3);
      P(i + 2, i + 2) += q * dt * dt;
    }
    P.diagonal().tail<kDirections>().array() += kReshape * kReshape * dt;
  }
  noise_ = noise;
  unseen_ = seen_ ? unseen_ + dt : dt;
  seen_ = false;
  Take(ways_[0], ways_[1]);
}

Footprint BodyFilter::Expected(double sigma, double most) const {
  Footprint f;
  f.p = p();
  f.v = v();
  const Covariance P = Changed(all_, 0.0).P;
  for (int k = 0; k < kDirections; ++k) {
    const auto i = static_cast<size_t>(k);
    const Row row = Model(k, 0.0);
    f.reach[i] = all_.x[4 + k];
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

/// Of the outline's reach from p, wherever p is: after a while unseen neither place nor reaches are
/// known in W, but their sums are as soon as they are seen again.
double BodyFilter::ReachVariance(int k) const {
  const auto& P = all_.P;
  const Eigen::Matrix2d place =
      P.topLeftCorner<2, 2>() + 1e-9 * Eigen::Matrix2d::Identity();  // known exactly at first
  const Eigen::Vector2d with = P.block<2, 1>(0, 4 + k);
  return P(4 + k, 4 + k) - with.dot(place.inverse() * with);
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
      const double doubt = ReachVariance(k) / (kOutlier * kOutlier);
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
    if (std::abs(rest) <= kOutlier)
      rigid += ReachVariance(k) < kKnown * kKnown;
    else
      for (auto& way : ways_) way.P(4 + k, 4 + k) += rest * rest;
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
      end = {all_.x[4 + k], std::min(end.points + 2, kMostPoints)};
      continue;
    }
    end.points = std::max(0, end.points - 1);
    double beyond = reach.along - Model(k, reach.age).dot(all_.x);
    if (end.points >= kSure)
      beyond = std::min(beyond, std::max(0.0, end.place + kStretch - all_.x[4 + k]));
    const bool known = ReachVariance(k) < kKnown * kKnown;
    for (auto& way : ways_) {
      if (beyond <= 0.0 && known) {  // hidden, or never was: doubted first, then forgotten slowly
        way.P(4 + k, 4 + k) += kDoubt * kDoubt;
        continue;
      }
      way.x[4 + k] += beyond > 0.0 ? beyond : kShrink * beyond;
      if (beyond <= 0.0) continue;
      way.P.row(4 + k).setZero();
      way.P.col(4 + k).setZero();
      way.P(4 + k, 4 + k) = unseen * unseen;
    }
  }
  Take(ways_[0], ways_[1]);
}

namespace {

/// Kalman update of x and P by the innovation at the state `at`; returns the log likelihood but for
/// a constant.
template <class State, class Covariance>
double Update(const Eigen::MatrixXd& model, const Eigen::VectorXd& z, double sigma, State* x,
              Covariance* P) {
  Eigen::MatrixXd S = model * *P * model.transpose();
  S += kCommon * kCommon * model.leftCols<2>() * model.leftCols<2>().transpose();
  S.diagonal().array() += sigma * sigma;
  const Eigen::LLT<Eigen::MatrixXd> factors(S);
  const Eigen::MatrixXd gain = factors.solve(model * *P).transpose();
  const Eigen::VectorXd innovation = z - model * *x;
  *x += gain * innovation;
  *P -= gain * S * gain.transpose();
  const Eigen::MatrixXd L = factors.matrixL();
  return -0.5 * innovation.dot(factors.solve(innovation)) - L.diagonal().array().log().sum();
}

}  // namespace

Sight BodyFilter::Correct(const Reaches& seen, double sigma, double unseen) {
  std::array<double, kDirections> innovation{};
  Eigen::Matrix<double, kDirections, kStates> H;
  Eigen::Matrix<double, kDirections, 1> z;
  int n = 0;
  double age = 0.0;
  for (int k = 0; k < kDirections; ++k) {
    const Reach& reach = seen[static_cast<size_t>(k)];
    const Row row = Model(k, reach.age);
    innovation[static_cast<size_t>(k)] = reach.along - row.dot(all_.x);
    if (!reach.edge) continue;
    H.row(n) = row;
    z[n++] = reach.along;
    age += reach.age;
  }
  const int rigid = Reshape(seen, innovation);
  if (n > 0) {
    age /= n;
    const double change = ChangeSince(age);
    std::array<Hypothesis, 4> next = {ways_[0], ways_[1], Changed(ways_[0], age),
                                      Changed(ways_[1], age)};
    std::array<double, 4> odds{};
    for (size_t i = 0; i < 4; ++i)
      odds[i] = std::log(next[i].weight * (i < 2 ? 1.0 - change : change)) +
                Update(H.topRows(n), z.head(n), sigma, &next[i].x, &next[i].P);
    const double most = *std::max_element(odds.begin(), odds.end());
    double sum = 0.0;
    for (size_t i = 0; i < 4; ++i) sum += next[i].weight = std::exp(odds[i] - most);
    for (auto& way : next) way.weight /= sum;
    Take(Merged(next[0], next[1]), Merged(next[2], next[3]));
    unseen_ = age;
    seen_ = true;
  }
  Uncover(seen, unseen);
  return {n, rigid};
}

double BodyFilter::Distance(const Reaches& seen, double sigma, double least) const {
  double sum = 0.0;
  int n = 0;
  for (int k = 0; k < kDirections; ++k) {
    const Reach& reach = seen[static_cast<size_t>(k)];
    const Row row = Model(k, reach.age);
    const double innovation = reach.along - row.dot(all_.x);
    if (!reach.edge) continue;
    const double s = std::max(row.dot(all_.P * row.transpose()) + sigma * sigma, least * least);
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
    const auto beyond = [&](const Eigen::Vector2d& q) {
      return Direction(k).dot(q) - all_.x[4 + k];
    };
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
  return 0.5 *
         (CenterVariance(Eigen::Vector2d::UnitX()) + CenterVariance(Eigen::Vector2d::UnitY()));
}

double BodyFilter::CenterVariance(const Eigen::Vector2d& d) const {
  constexpr int kHalf = kDirections / 2;
  const double turn = std::atan2(d.y(), d.x()) / (2.0 * M_PI);
  const int k = (static_cast<int>(std::lround(turn * kDirections)) + kDirections) % kHalf;
  Row row = Row::Zero();
  row.head<2>() = Direction(k).transpose();
  row[4 + k] = 0.5;
  row[4 + k + kHalf] = -0.5;
  return row.dot(all_.P * row.transpose());
}

double BodyFilter::VelocityVariance() const {
  const double change = seen_ ? 0.0 : ChangeSince(0.0);
  return 0.5 * (all_.P(2, 2) + all_.P(3, 3)) + change * noise_.change_speed * noise_.change_speed;
}

}  // namespace chase::mapping
