// The image's edges against a pinhole camera on a body whose z axis follows the thrust.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <random>
#include <utility>

#include "common/math/rotation.h"
#include "common/world/rig.h"
#include "services/planning/field_of_view.h"

namespace chase::planning {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kGravity = 9.80665, kDrag = 0.4;  // m/s^2, 1/s

double Evaluated(const std::vector<double>& c, double tau) {
  double y = 0.0;
  for (size_t k = c.size(); k-- > 0;) y = y * tau + c[k];
  return y;
}

Vector3d Evaluated(const Curve& c, double tau, int order = 0) {
  Vector3d sum = Vector3d::Zero();
  for (Eigen::Index k = order; k < c.rows(); ++k) {
    double factor = std::pow(tau, static_cast<double>(k - order));
    for (int i = 0; i < order; ++i) factor *= static_cast<double>(k - i);
    sum += factor * c.row(k).transpose();
  }
  return sum;
}

/// A chase over `duration` s: the drone behind a target, both on random curves or lines.
struct Scene {
  Curve plan, target;
  std::vector<double> yaw;
  double duration = 2.5;

  explicit Scene(unsigned seed, bool straight = false) {
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    plan = Curve::Zero(6, 3);
    target = Curve::Zero(4, 3);
    const double heading = 3.0 * normal(random), away = 3.0 + 0.5 * normal(random);
    plan.row(0) << 0.0, 0.0, 1.2 + 0.2 * normal(random);
    target.row(0) << away * std::cos(heading), away * std::sin(heading), 0.4;
    for (int k = 1; k < 6; ++k)
      for (int a = 0; a < 3; ++a) plan(k, a) = (a == 2 ? 0.1 : 0.7) * normal(random);
    for (int k = 1; k < 4; ++k)
      for (int a = 0; a < 2; ++a) target(k, a) = 0.7 * normal(random);
    yaw = {heading, 0.2 * normal(random), 0.2 * normal(random)};
    if (!straight) return;
    plan.bottomRows(4).setZero();
    target.bottomRows(2).setZero();
    yaw = {heading, 0.8 * normal(random)};
  }

  /// The target's centre in the body's frame; `follow`: the yaw points at it.
  Vector3d InBody(double tau, bool follow) const {
    const Vector3d r = Evaluated(target, tau) - Evaluated(plan, tau);
    const Vector3d v = Evaluated(plan, tau, 1) / duration;
    const Vector3d z = (Evaluated(plan, tau, 2) / (duration * duration) +
                        kDrag * Vector3d(v.x(), v.y(), 0.0) + Vector3d(0, 0, kGravity))
                           .normalized();
    const double psi = follow ? std::atan2(r.y(), r.x()) : Evaluated(yaw, tau);
    const Vector3d y = z.cross(Vector3d(std::cos(psi), std::sin(psi), 0.0)).normalized();
    Matrix3d R_WB;
    R_WB << y.cross(z), y, z;
    return R_WB.transpose() * r;
  }

  /// Least distance of it from the image's edges, px; with `follow` the upper and lower edge only.
  double Inside(const world::Rig& rig, double tau, bool follow) const {
    const Vector3d p_C = rig.R_BC().transpose() * InBody(tau, follow);
    if (p_C.z() <= 0.0) return -1e9;
    const Eigen::Vector2d px = rig.Project(p_C);
    const double vertical = std::min(px.y(), 2.0 * rig.center_v_px - px.y());
    return follow ? vertical : std::min({vertical, px.x(), 2.0 * rig.center_u_px - px.x()});
  }
  double Inside(const world::Rig& rig, bool follow, double from) const {
    double least = HUGE_VAL;
    for (int i = 0; i <= 400; ++i)
      least = std::min(least, Inside(rig, from + (1.0 - from) * i / 400.0, follow));
    return least;
  }
};

View ViewOf(const world::Rig& rig) {
  const double pitch = rig.camera_pitch_deg * M_PI / 180.0;
  const double half = std::atan(rig.center_v_px / rig.focal_px);
  return {std::tan(half + pitch), std::tan(half - pitch), rig.center_u_px / rig.focal_px, kDrag};
}

void Compare(bool follow, double from) {
  const world::Rig rig;
  int kept = 0, clear = 0, refused = 0;
  for (unsigned seed = 0; seed < 4000; ++seed) {
    const Scene scene(seed);
    const double inside = scene.Inside(rig, follow, from);
    const bool keeps = KeepsView(scene.plan, scene.target, scene.duration,
                                 follow ? nullptr : &scene.yaw, ViewOf(rig), from);
    EXPECT_FALSE(keeps && inside < -0.01) << seed << ": " << inside;
    kept += keeps;
    clear += inside > 0.5;
    refused += inside > 0.5 && !keeps;
  }
  EXPECT_GE(kept, 300);
  EXPECT_LE(refused, clear / 200) << clear;
}

TEST(FieldOfView, IsThatOfACameraOnATiltedBody) { Compare(false, 0.0); }
TEST(FieldOfView, WithTheYawOnTheTarget) { Compare(true, 0.0); }
TEST(FieldOfView, FromALaterTimeOn) { Compare(false, 0.4); }

/// Tangents below, above and beside the body's level axis up to which the target is seen; none
/// where it is not in front.
std::optional<View> Seen(const Scene& scene, bool follow) {
  constexpr int kSamples = 2000;
  View seen{-HUGE_VAL, -HUGE_VAL, -HUGE_VAL, kDrag};
  for (int i = 0; i <= kSamples; ++i) {
    const Vector3d p = scene.InBody(static_cast<double>(i) / kSamples, follow);
    if (p.x() < 0.1 * p.norm()) return std::nullopt;
    seen.down = std::max(seen.down, -p.z() / p.x());
    seen.up = std::max(seen.up, p.z() / p.x());
    seen.side = std::max(seen.side, std::abs(p.y()) / p.x());
  }
  return seen;
}

// Whatever is left out of a bound shows at an edge that the target just passes.
TEST(FieldOfView, AnEdgeThatIsJustPassedIsAndOneThatIsNotIsNot) {
  constexpr double kJust = 1e-5, kWide = 10.0;
  int asked = 0, kept = 0;
  for (unsigned seed = 0; seed < 1000; ++seed)
    for (const auto& [follow, straight] :
         {std::pair(false, false), {true, false}, {false, true}, {true, true}}) {
      const Scene scene(seed, straight);
      const auto seen = Seen(scene, follow);
      for (double View::*edge : {&View::down, &View::up, &View::side}) {
        if (!seen || (follow && edge == &View::side)) continue;
        View view{kWide, kWide, kWide, kDrag};
        const auto keeps = [&](double more) {
          view.*edge = (*seen).*edge + more;
          return KeepsView(scene.plan, scene.target, scene.duration, follow ? nullptr : &scene.yaw,
                           view);
        };
        EXPECT_FALSE(keeps(-kJust)) << seed << follow;
        ++asked;
        kept += keeps(100.0 * kJust);
      }
    }
  EXPECT_GT(asked, 3000);
  EXPECT_GT(kept, 0.97 * asked) << asked;
}

TEST(FieldOfView, OneInstantIsSeenAsTheCameraSeesIt) {
  const world::Rig rig;
  for (unsigned seed = 0; seed < 200; ++seed) {
    const Scene scene(seed);
    const Vector3d r = Evaluated(scene.target, 0.3) - Evaluated(scene.plan, 0.3);
    const Vector3d a = Evaluated(scene.plan, 0.3, 2) / (scene.duration * scene.duration);
    const Vector3d rate = Evaluated(scene.plan, 0.3, 1) / scene.duration;
    const double below = SeenBelow(r, rate, a, kDrag), pitch = rig.camera_pitch_deg * M_PI / 180.0;
    if (!std::isfinite(below)) continue;
    const double v = rig.focal_px * std::tan(std::atan(below) - pitch) + rig.center_v_px;
    EXPECT_NEAR(std::min(v, 2.0 * rig.center_v_px - v), scene.Inside(rig, 0.3, true), 1e-6);
  }
}

TEST(FieldOfView, NumbersThatAreNoneAreNotInIt) {
  Scene scene(1);
  scene.plan(2, 1) = NAN;
  EXPECT_FALSE(KeepsView(scene.plan, scene.target, 2.5, nullptr, ViewOf({})));
}

}  // namespace
}  // namespace chase::planning
