#include "services/planning/margins.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "services/planning/separations.h"

namespace chase::planning {
namespace {

// Margins are taken back in these shares until the start, the target, or the line of sight at the
// start is outside the shape.
constexpr double kShares[] = {1.0, 0.75, 0.5, 0.25, 0.0};
constexpr int kSamples = 24;
constexpr double kRounding = 1e-4;  // m

Eigen::Matrix3d Grown(const world::Obstacle& o, const Ellipsoid& e, double margin) {
  const Eigen::Matrix3d shape = SortingShape(o, e);
  return margin > 0.0 ? world::Inflated(shape, margin) : shape;
}

}  // namespace

Hull::Hull(const Curve& curve_) : curve(curve_), has_boxes(curve.rows() <= 7) {
  whole = {Eigen::Array3d::Constant(-HUGE_VAL), Eigen::Array3d::Constant(HUGE_VAL)};
  if (!has_boxes) return;
  Points left = ToPoints(curve, 6);
  whole = BoxOf(left, 7, 1e-6);
  Points right = Halve(&left);
  for (int a = 0; a < 2; ++a) {
    Points* half = a == 0 ? &left : &right;
    const Points later = Halve(half);
    quarters[2 * a] = BoxOf(*half, 7, 1e-6);
    quarters[2 * a + 1] = BoxOf(later, 7, 1e-6);
  }
}

bool IsPlainlyOutside(const Hull& curve, const Curve& center, const Eigen::Array3d& half) {
  if (!curve.has_boxes) return false;
  if (!MayTouch(curve.whole, center, half, kClear)) return true;
  for (const Box& box : curve.quarters)
    if (MayTouch(box, center, half, kClear)) return false;
  return true;
}

bool StaysOutside(const Curve& curve, const Curve& center, const Eigen::Matrix3d& R, double limit) {
  for (int i = 0; i <= kSamples; ++i) {
    const double tau = static_cast<double>(i) / kSamples;
    if (SquaredNorm(R, Evaluate(curve, tau) - Evaluate(center, tau)) <= limit) return false;
  }
  return true;
}

FirstSight::FirstSight(const Problem& problem)
    : p(problem.start.row(0).transpose()), q(problem.target.row(0).transpose()) {
  box = {p.array().min(q.array()) - 1e-6, p.array().max(q.array()) + 1e-6};
}

bool FirstSight::IsBeyond(const Curve& center, const Eigen::Matrix3d& R, const Eigen::Array3d& half,
                          double limit) const {
  const Curve first = center.topRows(1);
  return !MayTouch(box, first, half, limit) ||
         world::SegmentSquaredDistance(p, q, center.row(0).transpose(), R) > limit;
}

StartCheck::StartCheck(const Problem& problem) : problem_(problem) {
  start_.center = problem.start.topRows(1);
  seen_.center = problem.target.topRows(1);
}

bool StartCheck::IsSafe(const Ellipsoid& e, double radius) {
  if (!e.body) {
    const Eigen::Vector3d offset = (problem_.start.row(0) - e.center.row(0)).transpose();
    return SquaredNorm(e.safety, offset) > 1.0;
  }
  start_.radius = math::Polynomial::Constant(1, radius);
  return IsOff(e, nullptr);
}

bool StartCheck::IsInSight(const Ellipsoid& e, double share) {
  start_.radius = math::Polynomial::Constant(1, share * problem_.sight_radius);
  seen_.radius = TargetRadius(problem_, share).head(1);
  return IsOff(e, &seen_);
}

bool StartCheck::IsOff(const Ellipsoid& e, const world::Ball* target) {
  start_.radius[0] += kRounding;
  return !world::Touch(start_, target, *e.body, 0.0);
}

void Note(std::string* notes, const std::string& text) {
  if (!notes) return;
  if (!notes->empty()) *notes += "; ";
  *notes += text;
}

void ClearStart(const world::Obstacle& o, double growth, const Curve& start, Ellipsoid* e) {
  const Eigen::Vector3d offset = (start.row(0) - e->center.row(0)).transpose();
  for (const double share : {1.0, 0.5, 0.0}) {
    if (share < 1.0) {
      e->safety = Grown(o, *e, share * growth);
      e->grown_by[0] = -1.0;
    }
    if (SquaredNorm(e->safety, offset) > kClear) return;
  }
  e->safety = kPoint * Eigen::Matrix3d::Identity();
}

void RelaxSafety(const world::Obstacle& o, double hard, double margin, double uncertainty,
                 bool searched, StartCheck* start, Ellipsoid* e, std::string* notes) {
  for (double share : kShares) {
    e->safety_radius = hard + share * margin;
    if (share < 1.0 && searched) {
      e->safety = Grown(o, *e, e->safety_radius + uncertainty);
      e->grown_by[0] = -1.0;
    }
    if (!start->IsSafe(*e, e->safety_radius)) {
      if (e->body && margin == 0.0) break;  // no share makes a difference
      continue;
    }
    if (share < 1.0) Note(notes, "starts within the margin of obstacle " + std::to_string(e->id));
    if (e->body && searched) ClearStart(o, e->safety_radius + uncertainty, start->curve(), e);
    return;
  }
  e->safety_from = kLeaveBy;
  Note(notes, "starts inside obstacle " + std::to_string(e->id));
}

void RelaxSight(const world::Obstacle& o, const Growth& growth, const FirstSight& first,
                const Hull& target, const Problem& problem, StartCheck* start, Ellipsoid* e,
                std::string* notes) {
  const auto target_is_off = [&](double share) {
    if (IsPlainlyOutside(target, e->center, e->sight_half)) return true;
    if (!e->body)
      return StaysOutside(target.curve, e->center, e->sight, share > 0.0 ? kClear : 1.0);
    return world::Separate(TargetBall(problem, share), nullptr, *e->body).kept == world::Kept::kOff;
  };
  const bool beside = !MayTouch(first.box, e->center.topRows(1), e->sight_half, kClear);
  const auto begins_in_sight = [&](double share) {
    if (beside) return true;
    if (!first.IsBeyond(e->center, e->sight, e->sight_half, share > 0.0 ? kClear : 1.0))
      return false;
    return !e->body || start->IsInSight(*e, share);
  };
  std::optional<double> kept;  // share that the target keeps off
  const auto take = [&](double share) {
    if (share == e->sight_share) return;
    e->sight_share = share;
    e->sight = Grown(o, *e, share * growth.sight);
    e->grown_by[1] = -1.0;
  };
  const auto note = [&](double share, const std::string& where) {
    if (share == 1.0) return;
    Note(notes, where + "obstacle " + std::to_string(e->id) + ", " +
                    std::to_string(static_cast<int>(100.0 * share)) +
                    " % of the target's margin and uncertainty kept");
  };
  for (double share : kShares) {
    take(share);
    if (!target_is_off(share)) continue;
    if (!kept) kept = share;
    if (!begins_in_sight(share)) continue;
    return note(share, share < *kept ? "sight starts within the margin of "
                                     : "the target passes within the sight margin of ");
  }
  if (kept) {
    note(*kept, "the target passes within the sight margin of ");
    return take(*kept);
  }
  e->sight_from = kNoSight;
  Note(notes, "obstacle " + std::to_string(e->id) + " holds the target, its shadow is ignored");
}

}  // namespace chase::planning
