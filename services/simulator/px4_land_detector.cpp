#include "services/simulator/px4_land_detector.h"

#include <cmath>

namespace chase::simulator {
namespace {

constexpr int64_t kStage = 333'333;         // us, LNDMC_TRIG_TIME / 3
constexpr double kClimbs = 0.25;            // m/s, LNDMC_Z_VEL_MAX; 0.5 before 1.14
constexpr double kMoves = 1.5;              // m/s, LNDMC_XY_VEL_MAX
constexpr double kRotates = 0.35;           // rad/s, LNDMC_ROT_MAX
constexpr double kWider = 2.5;              // the limits, once it may have landed
constexpr double kThrMin = 0.12;            // MPC_THR_MIN
constexpr double kManThrMin = 0.08;         // MPC_MANTHR_MIN
constexpr double kLow = 0.3, kLeast = 0.1;  // of the way from MPC_THR_MIN to the hover

}  // namespace

void LandDetector::Stage::Set(bool condition, int64_t utime) {
  if (!condition || holds) since = utime;
  holds = condition && (holds || utime - since >= kStage);
}

bool LandDetector::Update(const Inputs& in) {
  ground_contact_.Set(TouchesGround(in), in.utime);
  maybe_landed_.Set(MayHaveLanded(in), in.utime);
  landed_.Set(!in.armed || maybe_landed_.holds, in.utime);
  return landed_.holds;
}

bool LandDetector::TouchesGround(const Inputs& in) const {
  if (!in.armed) return true;
  const bool asked = !in.controls_climb || in.descends || maybe_landed_.holds || landed_.holds;
  const double climbs = kClimbs * (maybe_landed_.holds ? kWider : 1.0);
  return asked && in.throttle <= kThrMin + kLow * (in.hover - kThrMin) &&
         std::abs(in.v_WB.z()) <= climbs && in.v_WB.head<2>().norm() <= kMoves;
}

bool LandDetector::MayHaveLanded(const Inputs& in) const {
  if (!in.armed) return true;
  const double least =
      in.controls_climb ? kThrMin + kLeast * (in.hover - kThrMin) : kManThrMin + 0.01;
  const double rotates = kRotates * (maybe_landed_.holds ? kWider : 1.0);
  return in.throttle <= least && in.w_WB_B.head<2>().norm() <= rotates && ground_contact_.holds;
}

}  // namespace chase::simulator
