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

Vector3d Direction(const Vector3d& way) {
  const double length = way.norm();
  return length > 0.0 ? Vector3d(way / length) : Vector3d::UnitX();
}

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
  bool TouchesAt(double tau) const;

 private:
  enum class Answer { kPlane, kOverlap, kOpen };

  int Columns() const;
  Controls Powers() const;
  double Spread(const Controls& c, Eigen::Index i, const Vector3d& n) const;
  Vector3d Lowest(const Controls& c, double radius, const Vector3d& n) const;
  double LeastRadius(const Controls& c) const;
  Answer FindPlane(const Controls& c, double tolerance, Separation* s) const;
  void RaiseTo(const Vector3d& n, const Controls& c, int samples, double* gaps) const;
  bool Touches(const Controls& c, Separation s);
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

/// Of degree 16 at most; else, or where there is a NaN, not finite.
Controls Prover::Powers() const {
  const int columns = Columns();
  if (columns > Sweep::kTerms) return Controls::Constant(17, 1, NAN);
  Controls power = Controls::Zero(17, columns);
  PutBall(drone_, body_.center, 0, &power);
  if (target_) PutBall(*target_, body_.center, 4, &power);
  if (body_.sigmas != 0.0)
    for (int k = 0; k < 3; ++k)
      power.col(k).tail<9>() =
          Eigen::Map<const Eigen::Matrix<double, 9, 1>>(body_.covariance[k].data());
  return power;
}

double Prover::LeastRadius(const Controls& c) const {
  const double drone = c.row(3).minCoeff();
  return std::max(0.0, target_ ? std::min(drone, c.row(7).minCoeff()) : drone);
}

/// Standard deviations of the body's place along n, of unit length, in one column.
double Prover::Spread(const Controls& c, Eigen::Index i, const Vector3d& n) const {
  if (!(body_.sigmas > 0.0)) return 0.0;
  const double variance = n.dot(Eigen::Map<const Eigen::Matrix3d>(&c(8, i)) * n);
  return variance > 0.0 ? body_.sigmas * std::sqrt(variance) : 0.0;
}

/// The point z of the set { balls of their radius less `radius` - body } with the least n' z.
Vector3d Prover::Lowest(const Controls& c, double radius, const Vector3d& n) const {
  double least = HUGE_VAL, spread = 0.0;
  Eigen::Index column = 0;
  int row = 0;
  for (Eigen::Index i = 0; i < c.cols(); ++i) {
    const double here = Spread(c, i, n);
    for (int ball = 0; ball <= (target_ ? 4 : 0); ball += 4) {
      const double value =
          n.dot(c.block<3, 1>(ball, i)) - std::max(0.0, c(ball + 3, i) - radius) - here;
      if (value >= least) continue;
      least = value;
      spread = here;
      column = i;
      row = ball;
    }
  }
  Vector3d z = c.block<3, 1>(row, column) - std::max(0.0, c(row + 3, column) - radius) * n;
  if (spread > 0.0)
    z -= body_.sigmas * body_.sigmas / spread *
         (Eigen::Map<const Eigen::Matrix3d>(&c(8, column)) * n);
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

/// Raises `gaps`, at samples + 1 instants, to what a plane with normal n leaves between the body
/// and the balls.
void Prover::RaiseTo(const Vector3d& n, const Controls& c, int samples, double* gaps) const {
  const auto degree = static_cast<int>(c.cols()) - 1;
  const double body = n.dot(SupportPoint(body_, n));
  double weighted[2][Sweep::kTerms];
  for (int i = 0; i <= degree; ++i) {
    const double spread = Spread(c, i, n), weight = math::Binomial(degree, i);
    for (int ball = 0; ball <= (target_ ? 1 : 0); ++ball)
      weighted[ball][i] =
          weight * (n.dot(c.block<3, 1>(4 * ball, i)) - c(4 * ball + 3, i) - spread - body);
  }
  for (int k = 0; k <= samples; ++k) {
    const double t = k / static_cast<double>(samples), rest = 1.0 - t;
    double least = HUGE_VAL;
    for (int ball = 0; ball <= (target_ ? 1 : 0); ++ball) {
      double power = 1.0, value = weighted[ball][0];
      for (int i = 1; i <= degree; ++i) {
        power *= t;
        value = value * rest + power * weighted[ball][i];
      }
      least = std::min(least, value);
    }
    gaps[k] = std::max(gaps[k], least);
  }
}

/// Looks for an instant at which the body is touched. Each normal bounds the gap from below at
/// every instant; the next is the one between body and balls where that leaves the least.
bool Prover::Touches(const Controls& c, Separation s) {
  constexpr int kTurns = 5, kSamples = 16;
  double gaps[kSamples + 1];
  std::fill(gaps, gaps + kSamples + 1, -HUGE_VAL);
  for (int turn = 0; turn < kTurns; ++turn) {
    RaiseTo(s.normal, c, kSamples, gaps);
    const auto least = static_cast<int>(std::min_element(gaps, gaps + kSamples + 1) - gaps);
    double gap = gaps[least], t = least;
    if (least > 0 && least < kSamples) {  // the parabola through the neighbours
      const double slope = 0.5 * (gaps[least + 1] - gaps[least - 1]);
      const double bend = gaps[least + 1] - 2.0 * gap + gaps[least - 1];
      if (bend > 0.0) {
        t -= slope / bend;
        gap -= 0.5 * slope * slope / bend;
      }
    }
    if (gap > 0.0) return false;
    t /= kSamples;
    Controls right = c, point(17, 1);
    CutOff(t, &right);
    point.col(0) = right.col(0);
    if (FindPlane(point, -kSlack, &s) != Answer::kOverlap) continue;
    Stop(Kept::kTouches, s.from + t * (s.to - s.from));
    return true;
  }
  return false;
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
  const Vector3d start = s.normal;
  if (FindPlane(c, kSlack, &s) == Answer::kPlane && Keeps(s)) return true;
  if (depth == kDepth && Touches(c, {s.from, s.to, start})) return false;
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
  if (!(body_.sigmas >= 0.0)) return result_;
  Controls c = ToBernstein(Powers());
  if (!c.allFinite()) return result_;
  if (s.to < 1.0) c = CutOff(s.to, &c);
  if (s.from > 0.0) CutOff(s.from / s.to, &c);
  if (Descend(c, s, kDepth)) result_.kept = Kept::kOff;
  return result_;
}

bool Prover::TouchesAt(double tau) const {
  const Controls power = Powers();
  Controls at(17, 1);
  at.col(0) = power.col(power.cols() - 1);
  for (Eigen::Index k = power.cols() - 1; k-- > 0;) at.col(0) = tau * at.col(0) + power.col(k);
  Separation s{tau, tau, Direction(at.col(0).head<3>())};
  return body_.sigmas >= 0.0 && FindPlane(at, -kSlack, &s) == Answer::kOverlap;
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
  return {SweptBall(ball), MeanOf(ball.center, from_, to_)};
}

void Separator::TakeRadii() {
  drone_.ball.TakeRadius();
  if (target_) target_->ball.TakeRadius();
}

/// Of unit length, from the mean of the body's centre to the nearest point between the means of the
/// balls' centres.
Vector3d Separator::Between(const Body& body) const {
  const Vector3d center = MeanOf(body.center, from_, to_);
  Vector3d n = drone_.mean - center;
  if (length_ > 0.0) n -= std::clamp(along_.dot(n) / length_, -1.0, 0.0) * along_;
  return Direction(n);
}

SeparationResult Separator::From(const Body& body) {
  const Separation s{from_, to_, Between(body)};
  const Sweep* target = target_ ? &target_->ball.Over(from_, to_, body) : nullptr;
  const Rooms room = ProvenRooms(s.normal, drone_.ball.Over(from_, to_, body), target, body);
  if (room.Least() >= 0.0) return {Kept::kOff, Certificate(s), room, 0.0};
  if (!(from_ >= 0.0 && from_ < to_ && to_ <= 1.0)) return {};
  return Prover(drone_.ball.ball(), target_ ? &target_->ball.ball() : nullptr, body).Prove(s);
}

SeparationResult Separate(const Ball& drone, const Ball* target, const Body& body, double from,
                          double to) {
  return Separator(drone, target, from, to).From(body);
}

bool Touch(const Ball& drone, const Ball* target, const Body& body, double tau) {
  return Prover(drone, target, body).TouchesAt(tau);
}

}  // namespace chase::world
