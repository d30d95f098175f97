#include "services/perception/localiser.h"

#include <algorithm>
#include <cmath>

namespace chase::perception {

namespace {

constexpr double kHiddenBy = 1.0;          // px that a side left out lies off the outline at least
constexpr double kDropPenalty = 4.0;       // cost of leaving out a side
constexpr int kMinPoints = 3;              // of a cluster that gives a range
constexpr int kManyPoints = 5;             // that went through it: the target is not there
constexpr double kCore = 0.6;              // share of the cylinder that such a ray goes through
constexpr double kBehind = 0.25;           // m behind the target where such a ray ends at least
constexpr double kMinVisible = 0.15;       // share of the expected box that a detection must cover
constexpr double kMaxRangeError = 0.15;    // share of the range; a worse first fix is none
constexpr double kHiddenPriorShare = 0.6;  // of the prior's gate where sides are left out

constexpr double kKnownRange = 0.25;  // m, standard deviation of the prediction
constexpr size_t kOneHidden = 5;      // readings with at most one side left out

using Sides = std::array<bool, 4>;

/// Readings of a silhouette from all sides seen to two sides hidden (left right top bottom).
constexpr std::array<Sides, 11> kReadings = {{{true, true, true, true},
                                              {false, true, true, true},
                                              {true, false, true, true},
                                              {true, true, false, true},
                                              {true, true, true, false},
                                              {false, true, false, true},
                                              {false, true, true, false},
                                              {true, false, false, true},
                                              {true, false, true, false},
                                              {true, true, false, false},
                                              {false, false, true, true}}};

double SurfaceDistance(const TargetPoint& point, const FitInput& input) {
  const Eigen::Vector3d q =
      point.p_W - (input.prior.position() - point.age * input.prior.velocity());
  const double side = q.head<2>().norm() - input.shape.size[0];
  const double cap = std::abs(q.z()) - 0.5 * input.shape.size[1];
  return side > 0.0 && cap > 0.0 ? std::hypot(side, cap) : std::max(side, cap);
}

/// Standard deviation of the prediction along the line of sight [m].
double RangeSigma(const FitInput& input) {
  const Eigen::Vector3d sight = (input.prior.position() - input.camera.p_WC).normalized();
  return std::sqrt(sight.dot(input.prior.covariance.topLeftCorner<3, 3>() * sight));
}

/// The points of a cluster that lie near the predicted cylinder; none when they are too few.
std::vector<TargetPoint> PointsOnTarget(const FitInput& input,
                                        const std::vector<TargetPoint>& cluster, double gate) {
  std::vector<TargetPoint> kept;
  for (const auto& p : cluster)
    if (std::abs(SurfaceDistance(p, input)) < gate) kept.push_back(p);
  if (static_cast<int>(kept.size()) < kMinPoints) kept.clear();
  return kept;
}

/// True when the lidar looked well through where the target should be, and hit something behind.
bool SawThrough(const TargetPoint& point, const FitInput& input) {
  const Eigen::Vector3d center = input.prior.position() - point.age * input.prior.velocity();
  const Eigen::Vector3d ray = point.p_W - point.p_WL, to_center = center - point.p_WL;
  const double length = std::max(1e-6, ray.head<2>().norm());
  const double along = ray.head<2>().dot(to_center.head<2>()) / length;
  const double beside = std::abs(ray.x() * to_center.y() - ray.y() * to_center.x()) / length;
  const double above = point.p_WL.z() + along / length * ray.z() - center.z();
  return beside < kCore * input.shape.size[0] &&
         std::abs(above) < kCore * 0.5 * input.shape.size[1] &&
         length > along + input.shape.size[0] + kBehind + 2.0 * RangeSigma(input);
}

int CountSeenThrough(const FitInput& input, const Clusters& clusters) {
  int count = 0;
  for (const auto& cluster : clusters)
    for (const auto& p : cluster) count += SawThrough(p, input);
  return count;
}

double MedianRange(const std::vector<TargetPoint>& cluster) {
  return cluster[cluster.size() / 2].range;
}

bool Visible(const FitInput& input) {
  if (input.detection->p_CT) return true;
  const auto expected = ProjectCylinder(input.camera, input.prior.position(), input.shape.size[0],
                                        input.shape.size[1]);
  return !expected || input.detection->box.area() >= kMinVisible * expected->area();
}

}  // namespace

bool Localiser::Agrees(const FitResult& fit, double prior_gate) const {
  if (!fit.ok || fit.prior_distance > prior_gate) return false;
  const double point_gate = 3.0 * config_.fit.lidar_sigma;
  if (fit.point_rms > point_gate) return false;
  return true;
}

bool Localiser::EdgesAgree(const FitResult& fit, const FitInput& input) const {
  const double gate = config_.fit.edge_gate * input.detection->silhouette.sigma_px;
  for (size_t side = 0; side < 4; ++side) {
    if (fit.used[side] && std::abs(fit.edge_px[side]) > gate) return false;
    const bool left_out =
        !input.use_side[side] && !input.detection->silhouette.samples[side].empty();
    if (left_out && std::abs(fit.edge_px[side]) < kHiddenBy) return false;
  }
  return true;
}

std::optional<FitResult> Localiser::WholeReading(FitInput* input) const {
  input->use_side = kReadings[0];
  FitResult fit = FitCylinder(*input, config_.fit);
  if (!Agrees(fit, config_.fit.prior_gate) || !EdgesAgree(fit, *input)) return std::nullopt;
  return fit;
}

std::optional<FitResult> Localiser::BestReading(FitInput* input) const {
  std::optional<FitResult> best = WholeReading(input);
  if (best) return best;
  double best_cost = 0.0;
  // Where the range is not known, two opposite sides must give it.
  const size_t readings = RangeSigma(*input) < kKnownRange ? kReadings.size() : kOneHidden;
  for (size_t k = 1; k < readings; ++k) {
    input->use_side = kReadings[k];
    FitResult fit = FitCylinder(*input, config_.fit);
    if (!Agrees(fit, kHiddenPriorShare * config_.fit.prior_gate) || !EdgesAgree(fit, *input))
      continue;
    fit.cost += kDropPenalty * static_cast<double>(std::count(input->use_side.begin(),
                                                              input->use_side.end(), false));
    if (best && fit.cost >= best_cost) continue;
    best = fit;
    best_cost = fit.cost;
  }
  return best;
}

std::optional<FitResult> Localiser::Correct(const FitInput& predicted,
                                            const Clusters& clusters) const {
  if (!Visible(predicted)) return std::nullopt;
  FitInput input = predicted;
  const double gate = config_.fit.lidar_gate + 2.0 * RangeSigma(predicted);
  // Near to far: what stands before the target may lend the blob's edge a few points, and only
  // the fit tells that they do not belong to it.
  for (const auto& cluster : clusters) {
    input.points = PointsOnTarget(predicted, cluster, gate);
    if (input.points.empty()) continue;
    const auto fit = BestReading(&input);
    if (fit) return fit;
  }
  input.points.clear();
  if (CountSeenThrough(predicted, clusters) >= kManyPoints) return std::nullopt;
  return BestReading(&input);
}

TargetGaussian Localiser::Guess(const Camera& camera, const Detection& detection, double range,
                                double range_sigma) const {
  const Eigen::Vector3d sight = camera
                                    .Ray(detection.box.x + 0.5 * detection.box.width,
                                         detection.box.y + 0.5 * detection.box.height)
                                    .normalized();
  const double side_sigma = 0.5 * config_.target_height + 0.1 * range;
  const double speed = config_.motion.initial_speed_sigma;
  const double vertical = config_.motion.initial_vertical_speed_sigma;
  TargetGaussian g;
  g.mean << camera.p_WC + range * sight, Eigen::Vector3d::Zero();
  g.covariance.setZero();
  g.covariance.topLeftCorner<3, 3>() = side_sigma * side_sigma * Eigen::Matrix3d::Identity() +
                                       range_sigma * range_sigma * sight * sight.transpose();
  g.covariance.diagonal().tail<3>() << speed * speed, speed * speed, vertical * vertical;
  return g;
}

std::optional<FitResult> Localiser::Acquire(const TargetShape& shape, const Camera& camera,
                                            const Detection& detection,
                                            const Clusters& clusters) const {
  const auto good = [&](const std::optional<FitResult>& fit) {
    if (!fit) return false;
    const Eigen::Vector3d sight = fit->posterior.position() - camera.p_WC;
    const double range = sight.norm();
    const Eigen::Vector3d n = sight / range;
    const double sigma = std::sqrt(n.dot(fit->posterior.covariance.topLeftCorner<3, 3>() * n));
    return sigma < kMaxRangeError * range;
  };
  FitInput input;
  input.shape = shape;
  input.camera = camera;
  input.detection = &detection;
  for (const auto& cluster : clusters) {
    if (static_cast<int>(cluster.size()) < kMinPoints) continue;
    const double range = MedianRange(cluster) + shape.size[0];
    input.prior = Guess(camera, detection, range, 0.3);
    input.points = PointsOnTarget(input, cluster, 2.0 * config_.fit.lidar_gate);
    const auto fit = WholeReading(&input);
    if (good(fit)) return fit;
  }
  // From the size alone: every side must be seen, since nothing tells what is hidden.
  const auto& cut = detection.cut;
  const bool whole = !cut[kLeft] && !cut[kRight] && !cut[kTop] && !cut[kBottom];
  if (!detection.p_CT && !whole) return std::nullopt;
  const double range = detection.p_CT ? detection.p_CT->norm()
                                      : camera.rig.focal_px * 2.0 * shape.size[0] /
                                            std::max(1.0, detection.box.width);
  input.prior = Guess(camera, detection, range, 0.4 * range);
  input.points.clear();
  const auto fit = WholeReading(&input);
  if (!good(fit)) return std::nullopt;
  input.prior = fit->posterior;
  if (CountSeenThrough(input, clusters) >= kManyPoints) return std::nullopt;
  return fit;
}

}  // namespace chase::perception
