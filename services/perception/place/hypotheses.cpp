#include "services/perception/place/hypotheses.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "services/perception/place/target_points.h"

namespace chase::perception {

namespace {

constexpr double kKnownRange = 0.25;  // m, standard deviation of the prediction
constexpr double kAside = 0.1;        // share of the range that a new target may lie beside its box

constexpr double kHidden = 0.02;      // how often a given side is hidden,
constexpr double kStillHidden = 0.3;  // and of what comes back from behind something
constexpr double kRunsOn = 0.04;      // how often a like colour goes on beyond a side,
constexpr double kRunsOnToo = 0.5;    // and beyond another one then

// What else has the target's colour: so many blobs a frame, anywhere in the image, sides so far
// apart (shares of its width), as far away as may be.
constexpr double kClutter = 0.3, kClutterSide = 0.16, kClutterDepth = 10.0;
constexpr double kStray = 0.02;  // how often a measured position is not the target's
constexpr double kThrough = 1.0, kMostThrough = 20.0;  // for rays that went through it

/// Density of the sides as they were seen, hidden ones anywhere inside.
double LogSides(const FitResult& fit, const FitInput& input) {
  const double sigma = input.detection->silhouette.sigma_px / std::sqrt(kEdgeWeight);
  const double range = (fit.posterior.position() - input.camera.p_WC).norm();
  const double px = input.camera.rig.focal_px / std::max(kNearest, range);
  double sum = 0.0;
  double runs_on = kRunsOn;
  bool still_hidden = input.reappears;
  for (size_t side = 0; side < 4; ++side) {
    if (input.detection->goes_on[side] && !input.detection->parted[side]) {
      sum += std::log(runs_on);
      runs_on = kRunsOnToo;
    }
    if (input.detection->silhouette.samples[side].empty()) continue;
    const double extent =
        std::max(2.0, px * (side == kLeft || side == kRight ? 2.0 * input.shape.MeanHalfWidth()
                                                            : input.shape.size[1]));
    if (fit.used[side]) {
      sum -= std::log(sigma * std::sqrt(2.0 * M_PI));
    } else if (fit.edge_px[side] < 0.0) {
      const bool other = fit.used[side ^ 1u];
      sum += std::log((still_hidden && other ? kStillHidden : kHidden) / extent);
      still_hidden = still_hidden && !other;
    } else {
      sum += std::log(runs_on / extent);
      runs_on = kRunsOnToo;
    }
  }
  return sum;
}

/// Density of a measured position that is anything's [1/m^3]: anywhere in the image, as far away as
/// may be. A pixel is the wider the further away.
double LogAnywhere(const FitInput& input) {
  const auto& rig = input.camera.rig;
  const double per_px = std::max(kNearest, input.detection->p_CT->norm()) / rig.focal_px;
  return -std::log(rig.width_px * per_px * rig.height_px * per_px * kClutterDepth);
}

/// Density of a measured position where the target lies as fitted; now and then it is a stray one.
double LogPosition(const FitResult& fit, const FitInput& input) {
  const double stray = std::log(kStray) + LogAnywhere(input);
  const Eigen::LLT<Eigen::Matrix3d> llt(input.detection->p_CT_covariance);
  if (llt.info() != Eigen::Success) return stray;
  const Eigen::Vector3d off =
      input.camera.R_WC.transpose() * (fit.posterior.position() - input.camera.p_WC) -
      *input.detection->p_CT;
  const double log_sigmas = llt.matrixLLT().diagonal().array().log().sum();
  const double measured =
      -0.5 * llt.matrixL().solve(off).squaredNorm() - log_sigmas - 1.5 * std::log(2.0 * M_PI);
  return std::max(measured, stray);
}

}  // namespace

bool RangeIsKnown(const FitInput& input) {
  return !input.points.empty() || RangeSigma(input.prior, input.camera) < kKnownRange;
}

TargetGaussian NewTarget(const Camera& camera, const cv::Rect2d& box, const TargetShape& shape,
                         double range, double range_sigma) {
  const Eigen::Vector3d sight = camera.Sight(box);
  const Eigen::Matrix3d along = sight * sight.transpose();
  const double beside = 0.5 * shape.size[1] + kAside * range;
  TargetGaussian g;
  g.mean.head<3>() = camera.p_WC + range * sight;
  g.covariance.topLeftCorner<3, 3>() =
      beside * beside * (Eigen::Matrix3d::Identity() - along) + range_sigma * range_sigma * along;
  g.ForgetVelocity();
  return g;
}

double LogTarget(const FitResult& fit, const FitInput& input, const FitConfig& config) {
  double sum = fit.log_evidence + LogSides(fit, input);
  if (input.detection->p_CT) sum += LogPosition(fit, input);
  if (fit.n_points > 0) {
    const double n = std::min(kLidarWeight, static_cast<double>(fit.n_points));
    sum -= std::log(config.lidar_sigma / std::sqrt(n) * std::sqrt(2.0 * M_PI));
    sum += LogSeenThrough(input, fit.posterior);
  }
  return sum;
}

double LogSeenThrough(const FitInput& input, const TargetGaussian& target) {
  return -std::min(kMostThrough, kThrough * RaysThrough(input, target));
}

double LogClutter(const FitInput& input) {
  const auto& samples = input.detection->silhouette.samples;
  const auto& rig = input.camera.rig;
  double sum = std::log(kClutter);
  const auto add = [&](Side a, Side b, double extent) {
    const int seen = !samples[a].empty() + !samples[b].empty();
    if (seen > 0) sum -= std::log(extent);
    if (seen > 1) sum -= std::log(kClutterSide * rig.width_px);
  };
  add(kLeft, kRight, rig.width_px);
  add(kTop, kBottom, rig.height_px);
  if (!input.points.empty()) sum -= std::log(kClutterDepth);
  if (input.detection->p_CT) sum += LogAnywhere(input);
  return sum;
}

}  // namespace chase::perception
