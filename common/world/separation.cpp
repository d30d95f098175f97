#include "common/world/separation.h"

#include <algorithm>
#include <cmath>

#include "common/math/bernstein.h"
#include "common/math/simplex.h"

namespace chase::world {
namespace {

using Eigen::Vector3d;

constexpr int kDepth = 14;
constexpr int kIterations = 60;
constexpr double kSlack = 1e-9;  // m; more than all rounding for coordinates below 10 km

/// Bernstein coefficients over an interval, one a column: centre of the drone's ball from the
/// body's, its radius, the same of the target's, covariance of the body.
using Controls = Eigen::Matrix<double, 17, Eigen::Dynamic, 0, 17, 16>;

/// Into columns of power coefficients.
void PutBall(const Ball& ball, const Curve& center, int row, Controls* power) {
  power->block(row, 0, 3, ball.center.rows()) = ball.center.transpose();
  power->block(row, 0, 3, center.rows()) -= center.transpose();
  power->row(row + 3).head(ball.radius.size()) = ball.radius.transpose();
}

Controls ToBernstein(const Controls& power) {
  const int n = static_cast<int>(power.cols()) - 1;
  Controls c = Controls::Zero(17, n + 1);
  for (int j = 0; j <= n; ++j)
    for (int k = 0; k <= j; ++k) c.col(j) += math::BernsteinShare(n, j, k) * power.col(k);
  return c;
}

/// The mean over [from, to].
Vector3d MeanOf(const Curve& curve, double from, double to) {
  Vector3d sum = curve.row(0).transpose();
  if (from == 0.0 && to == 1.0) {
    for (Eigen::Index k = 1; k < curve.rows(); ++k)
      sum += 1.0 / static_cast<double>(k + 1) * curve.row(k).transpose();
    return sum;
  }
  double before = from, after = to;  // powers
  for (Eigen::Index k = 1; k < curve.rows(); ++k) {
    before *= from;
    after *= to;
    sum += (after - before) / ((to - from) * static_cast<double>(k + 1)) * curve.row(k).transpose();
  }
  return sum;
}

/// Cuts at t: returns the part before and leaves the part after in `rest`.
Controls CutOff(double t, Controls* rest) {
  Controls part = *rest;
  const Eigen::Index n = part.cols() - 1;
  for (Eigen::Index k = 1; k <= n; ++k) {
    for (Eigen::Index i = 0; i <= n - k; ++i)
      rest->col(i) = (1.0 - t) * rest->col(i) + t * rest->col(i + 1);
    part.col(k) = rest->col(0);
  }
  return part;
}

/// One attempt to separate a body from two balls, an interval at a time.
class Prover {
 public:
  Prover(const Ball& drone, const Ball* target, const Body& body)
      : drone_(drone), target_(target), body_(body) {}

  /// `s`: the interval, and the normal to start from.
  SeparationResult Prove(const Separation& s);

 private:
  enum class Answer { kPlane, kOverlap, kOpen };

  int Columns() const;
  Controls MakeControls(int columns) const;
  Vector3d Lowest(const Controls& c, double radius, const Vector3d& n) const;
  double LeastRadius(const Controls& c) const;
  Answer FindPlane(const Controls& c, double tolerance, Separation* s) const;
  bool Keeps(const Separation& s);
  bool Descend(const Controls& c, Separation s, int depth);
  bool Stop(Kept kept, double tau);

  const Ball& drone_;
  const Ball* target_;
  const Body& body_;
  SeparationResult result_;
};

int Prover::Columns() const {
  Eigen::Index n = std::max({drone_.center.rows(), drone_.radius.size(), body_.center.rows(),
                             Eigen::Index{body_.sigmas > 0.0 ? 3 : 1}});
  if (target_) n = std::max({n, target_->center.rows(), target_->radius.size()});
  return static_cast<int>(n);
}

Controls Prover::MakeControls(int columns) const {
  Controls power = Controls::Zero(17, columns);
  PutBall(drone_, body_.center, 0, &power);
  if (target_) PutBall(*target_, body_.center, 4, &power);
  if (body_.sigmas != 0.0)
    for (int k = 0; k < 3; ++k)
      power.col(k).tail<9>() =
          Eigen::Map<const Eigen::Matrix<double, 9, 1>>(body_.covariance[k].data());
  return ToBernstein(power);
}

double Prover::LeastRadius(const Controls& c) const {
  const double drone = c.row(3).minCoeff();
  return std::max(0.0, target_ ? std::min(drone, c.row(7).minCoeff()) : drone);
}

/// The point z of the set { balls of their radius less `radius` - body } with the least n' z.
Vector3d Prover::Lowest(const Controls& c, double radius, const Vector3d& n) const {
  double least = HUGE_VAL;
  Vector3d z = Vector3d::Zero();
  for (Eigen::Index i = 0; i < c.cols(); ++i) {
    Vector3d spread = Vector3d::Zero();
    if (body_.sigmas > 0.0) {
      const Eigen::Map<const Eigen::Matrix3d> S(&c(8, i));
      const Vector3d Sn = S * n;
      const double variance = n.dot(Sn);
      if (variance > 0.0) spread = body_.sigmas / std::sqrt(variance) * Sn;
    }
    for (int row = 0; row <= (target_ ? 4 : 0); row += 4) {
      const double more = std::max(0.0, c(row + 3, i) - radius);
      const Vector3d point = c.block<3, 1>(row, i) - more * n - spread;
      const double value = n.dot(point);
      if (value >= least) continue;
      least = value;
      z = point;
    }
  }
  return z - SupportPoint(body_, n);
}

/// Gilbert, Johnson and Keerthi's algorithm from the direction s->normal. kPlane: n' z >= radius
/// for all of the set; kOverlap: the set has a point that is nearer to the origin than the radius
/// and `tolerance`.
Prover::Answer Prover::FindPlane(const Controls& c, double tolerance, Separation* s) const {
  const double radius = LeastRadius(c);
  math::Simplex simplex;
  for (int i = 0; i < kIterations; ++i) {
    const Vector3d z = Lowest(c, radius, s->normal);
    if (!z.allFinite()) return Answer::kOpen;
    if (s->normal.dot(z) >= radius + kSlack) return Answer::kPlane;
    if (!simplex.Add(z)) return Answer::kOpen;
    const double distance = simplex.nearest().norm();
    if (distance <= std::max(kSlack, radius + tolerance)) return Answer::kOverlap;
    s->normal = simplex.nearest() / distance;
  }
  return Answer::kOpen;
}

bool Prover::Stop(Kept kept, double tau) {
  result_.kept = kept;
  result_.tau = tau;
  result_.certificate.clear();
  return false;
}

/// The separation, if it holds.
bool Prover::Keeps(const Separation& s) {
  const Sweep drone(drone_, s.from, s.to, DegreeOf(drone_, body_));
  std::optional<Sweep> target;
  if (target_) target.emplace(*target_, s.from, s.to, DegreeOf(*target_, body_));
  const Rooms room = ProvenRooms(s.normal, drone, target ? &*target : nullptr, body_);
  if (!(room.Least() >= 0.0)) return false;
  const bool first = result_.certificate.empty();
  result_.room = first ? room
                       : Rooms{std::min(result_.room.drone, room.drone),
                               std::min(result_.room.target, room.target)};
  result_.certificate.push_back(s);
  return true;
}

/// `s`: the interval, and the normal to start from.
bool Prover::Descend(const Controls& c, Separation s, int depth) {
  if (FindPlane(c, kSlack, &s) == Answer::kPlane && Keeps(s)) return true;
  const double middle = 0.5 * (s.from + s.to);
  Controls right = c, point(17, 1);
  const Controls left = CutOff(0.5, &right);
  point.col(0) = right.col(0);
  Separation now{middle, middle, s.normal};
  if (FindPlane(point, -kSlack, &now) == Answer::kOverlap) return Stop(Kept::kTouches, middle);
  if (depth == 0) return Stop(Kept::kUndecided, middle);
  return Descend(left, {s.from, middle, now.normal}, depth - 1) &&
         Descend(right, {middle, s.to, now.normal}, depth - 1);
}

SeparationResult Prover::Prove(const Separation& s) {
  const int columns = Columns();
  if (columns > Sweep::kTerms || !(body_.sigmas >= 0.0)) return result_;
  Controls c = MakeControls(columns);
  if (!c.allFinite()) return result_;
  if (s.to < 1.0) c = CutOff(s.to, &c);
  if (s.from > 0.0) CutOff(s.from / s.to, &c);
  if (Descend(c, s, kDepth)) result_.kept = Kept::kOff;
  return result_;
}

}  // namespace

Separator::Separator(const Ball& drone, const Ball* target, double from, double to)
    : from_(from), to_(to), drone_(MakeParty(drone)) {
  if (!target) return;
  target_.emplace(MakeParty(*target));
  along_ = target_->mean - drone_.mean;
  length_ = along_.squaredNorm();
}

Separator::Party Separator::MakeParty(const Ball& ball) const {
  return {&ball, Sweep(ball, from_, to_, 0), MeanOf(ball.center, from_, to_)};
}

void Separator::TakeRadii() {
  drone_.sweep.SetRadius(drone_.ball->radius);
  if (target_) target_->sweep.SetRadius(target_->ball->radius);
}

void Separator::Raise(Party* party, const Body& body) const {
  const int degree = DegreeOf(*party->ball, body);
  if (party->sweep.degree != degree) party->sweep = Sweep(*party->ball, from_, to_, degree);
}

/// Of unit length, from the mean of the body's centre to the nearest point between the means of the
/// balls' centres.
Vector3d Separator::Between(const Body& body) const {
  const Vector3d center = MeanOf(body.center, from_, to_);
  Vector3d n = drone_.mean - center;
  if (length_ > 0.0) n -= std::clamp(along_.dot(n) / length_, -1.0, 0.0) * along_;
  const double distance = n.norm();
  return distance > 0.0 ? Vector3d(n / distance) : Vector3d::UnitX();
}

SeparationResult Separator::From(const Body& body) {
  Raise(&drone_, body);
  if (target_) Raise(&*target_, body);
  const Separation s{from_, to_, Between(body)};
  const Rooms room = ProvenRooms(s.normal, drone_.sweep, target_ ? &target_->sweep : nullptr, body);
  if (room.Least() >= 0.0) return {Kept::kOff, Certificate(s), room, 0.0};
  if (!(from_ >= 0.0 && from_ < to_ && to_ <= 1.0)) return {};
  return Prover(*drone_.ball, target_ ? target_->ball : nullptr, body).Prove(s);
}

SeparationResult Separate(const Ball& drone, const Ball* target, const Body& body, double from,
                          double to) {
  return Separator(drone, target, from, to).From(body);
}

}  // namespace chase::world
