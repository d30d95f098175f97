#include "services/perception/localiser.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace chase::perception {

namespace {

constexpr double kHiddenBy = 1.0;        // px that a side left out lies off the outline at least
constexpr double kHidden = 0.02;         // how often a given side is hidden
constexpr double kRunsOn = 0.002;        // how often a like colour goes on beyond a side
constexpr double kSharpTurn = 0.02;      // how often the target does what the motion leaves out:
constexpr double kTurnSpeed = 1.0;       // m/s, standard deviation of the speed it gains so
constexpr double kTurnShift = 0.12;      // m, and of the place
constexpr double kClear = 3.0;           // squared distance from the prediction that needs no other
constexpr double kNegligible = 7.0;      // logarithm of the odds of a hypothesis that is left out
constexpr int kSidesOfNew = 3;           // of what nothing is known of yet
constexpr int kLeastSides = 2;           // that must be seen
constexpr int kMinPoints = 3;            // of a cluster that gives a range
constexpr size_t kMostPoints = 40;       // in a fit
constexpr int kMostClusters = 2;         // that are tried
constexpr int kManyPoints = 5;           // that went through it: the target is not there
constexpr double kCore = 0.6;            // share of the cylinder that such a ray goes through
constexpr double kBehind = 0.25;         // m behind the target where such a ray ends at least
constexpr double kMinVisible = 0.15;     // share of the expected box that a detection must cover
constexpr double kMaxRangeError = 0.15;  // share of the range; a worse first fix is none
constexpr double kHiddenPriorShare = 0.6;  // of the prior's gate where sides are left out

constexpr double kKnownShare = 0.03;  // of the range, likewise
constexpr double kKnownRange = 0.25;  // m, standard deviation of the prediction
constexpr size_t kOneHidden = 5;      // readings with at most one side left out

// What else has the target's colour: so many blobs a frame, anywhere in the image, sides so far
// apart, as far away as may be.
constexpr double kClutter = 0.3, kClutterSidePx = 60.0, kClutterDepth = 10.0;
constexpr double kUnexplained = 0.5, kMostUnexplained = 6.0;  // odds for points at other ranges

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
  if (static_cast<int>(kept.size()) < kMinPoints) return {};
  const size_t step = 1 + kept.size() / kMostPoints;  // more would not tell more
  std::vector<TargetPoint> some;
  for (size_t i = 0; i < kept.size(); i += step) some.push_back(kept[i]);
  return some;
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

double CountPoints(const Clusters& clusters) {
  size_t count = 0;
  for (const auto& cluster : clusters) count += cluster.size();
  return static_cast<double>(count);
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

/// The same prediction of a target that has just braked, turned or been pushed; across the line of
/// sight only unless points tell the range, since the apparent size alone would take every pixel
/// that is hidden for a leap.
TargetGaussian AfterASharpTurn(const FitInput& input) {
  Eigen::Vector2d sight = (input.prior.position() - input.camera.p_WC).head<2>().normalized();
  Eigen::Matrix2d across = Eigen::Matrix2d::Identity();
  if (input.points.empty()) across -= sight * sight.transpose();
  TargetGaussian g = input.prior;
  g.covariance.topLeftCorner<2, 2>() += kTurnShift * kTurnShift * across;
  g.covariance.block<2, 2>(3, 3) += kTurnSpeed * kTurnSpeed * across;
  return g;
}

/// Tells which readings may hold: sides are hidden only where the blob is smaller than expected,
/// and go on only where it is larger. All may hold while the range is not known.
std::function<bool(const Sides&)> Sensible(const FitInput& input) {
  const auto expected = ProjectCylinder(input.camera, input.prior.position(), input.shape.size[0],
                                        input.shape.size[1]);
  const double range = (input.prior.position() - input.camera.p_WC).norm();
  if (!expected || RangeSigma(input) > kKnownShare * range)
    return [](const Sides&) { return true; };
  const auto fits = [](double seen, double wanted) {
    return std::abs(seen - wanted) < kHiddenBy + 3.0 * kKnownShare * wanted;
  };
  const bool wide = fits(input.detection->box.width, expected->width);
  const bool high = fits(input.detection->box.height, expected->height);
  return [wide, high](const Sides& use) {
    const bool sides = use[kLeft] && use[kRight], caps = use[kTop] && use[kBottom];
    return (sides || !wide) && (caps || !high);
  };
}

/// Logarithm of the density of the same sides and points where they belong to something else.
double LogClutter(const FitInput& input) {
  const auto& samples = input.detection->silhouette.samples;
  const auto& rig = input.camera.rig;
  double sum = std::log(kClutter);
  const auto add = [&](Side a, Side b, double extent) {
    const int seen = !samples[a].empty() + !samples[b].empty();
    if (seen > 0) sum -= std::log(extent);
    if (seen > 1) sum -= std::log(kClutterSidePx);
  };
  add(kLeft, kRight, rig.width_px);
  add(kTop, kBottom, rig.height_px);
  if (!input.points.empty()) sum -= std::log(kClutterDepth);
  return sum;
}

}  // namespace

bool Localiser::Agrees(const FitResult& fit, double prior_gate) const {
  if (!fit.ok || fit.prior_distance > prior_gate) return false;
  const double point_gate = 3.0 * config_.fit.lidar_sigma;
  if (fit.point_rms > point_gate) return false;
  return true;
}

bool Localiser::EdgesAgree(const FitResult& fit, const FitInput& input) const {
  if (!input.detection->p_CT && std::count(fit.used.begin(), fit.used.end(), true) < kLeastSides)
    return false;
  const double gate =
      std::max(config_.fit.edge_gate_px, 1.6 * input.detection->silhouette.sigma_px);
  for (size_t side = 0; side < 4; ++side) {
    if (fit.used[side] && std::abs(fit.edge_px[side]) > gate) return false;
    const bool left_out =
        !input.use_side[side] && !input.detection->silhouette.samples[side].empty();
    if (left_out && std::abs(fit.edge_px[side]) < kHiddenBy) return false;
    // Where the range is not known, what goes on beyond a side is a larger thing.
    if (left_out && fit.edge_px[side] > 0.0 && RangeSigma(input) > kKnownRange) return false;
  }
  return true;
}

/// One Gaussian with the mean and covariance of the mixture; all else from the likeliest.
FitResult Localiser::Joined(const std::vector<Hypothesis>& all) {
  const auto& best = *std::max_element(
      all.begin(), all.end(),
      [](const Hypothesis& a, const Hypothesis& b) { return a.log_weight < b.log_weight; });
  FitResult out = best.fit;
  double total = 0.0;
  Vector6d mean = Vector6d::Zero();
  for (const auto& h : all) {
    const double weight = std::exp(h.log_weight - best.log_weight);
    if (weight < std::exp(-kNegligible)) continue;
    total += weight;
    mean += weight * h.fit.posterior.mean;
  }
  mean /= total;
  Matrix6d covariance = Matrix6d::Zero();
  for (const auto& h : all) {
    const double weight = std::exp(h.log_weight - best.log_weight);
    if (weight < std::exp(-kNegligible)) continue;
    const Vector6d d = h.fit.posterior.mean - mean;
    covariance += weight / total * (h.fit.posterior.covariance + d * d.transpose());
  }
  out.posterior.mean = mean;
  out.posterior.covariance = covariance;
  out.log_odds = best.log_weight + std::log(total);
  return out;
}

std::optional<FitResult> Localiser::WholeReading(FitInput* input) const {
  input->use_side = kReadings[0];
  FitResult fit = FitCylinder(*input, config_.fit);
  if (!Agrees(fit, config_.fit.prior_gate) || !EdgesAgree(fit, *input)) return std::nullopt;
  return fit;
}

double Localiser::LogSides(const FitResult& fit, const FitInput& input) const {
  const double sigma = input.detection->silhouette.sigma_px / std::sqrt(config_.fit.edge_weight);
  const double range = (fit.posterior.position() - input.camera.p_WC).norm();
  const double px = input.camera.rig.focal_px / std::max(0.2, range);
  double sum = 0.0;
  for (size_t side = 0; side < 4; ++side) {
    if (input.detection->silhouette.samples[side].empty()) continue;
    const double extent = std::max(
        2.0,
        px * (side == kLeft || side == kRight ? 2.0 * input.shape.size[0] : input.shape.size[1]));
    if (fit.used[side])
      sum -= std::log(sigma * std::sqrt(2.0 * M_PI));
    else
      sum += std::log((fit.edge_px[side] < 0.0 ? kHidden : kRunsOn) / extent);
  }
  return sum;
}

double Localiser::LogTarget(const FitResult& fit, const FitInput& input) const {
  double sum = fit.log_evidence + LogSides(fit, input);
  if (fit.n_points > 0) {
    const double n = std::min(config_.fit.lidar_weight, static_cast<double>(fit.n_points));
    sum -= std::log(config_.fit.lidar_sigma / std::sqrt(n) * std::sqrt(2.0 * M_PI));
  }
  return sum;
}

void Localiser::Weigh(const FitInput& given, double log_prior, size_t readings,
                      std::vector<Hypothesis>* out) const {
  FitInput input = given;
  const double prior_gate = config_.fit.prior_gate;
  const auto sensible = Sensible(input);
  for (size_t k = 0; k < readings; ++k) {
    if (k >= kOneHidden && !out->empty()) return;
    if (!sensible(kReadings[k])) continue;
    input.use_side = kReadings[k];
    const FitResult fit = FitCylinder(input, config_.fit);
    const double gate = k == 0 ? prior_gate : kHiddenPriorShare * prior_gate;
    if (Agrees(fit, gate) && EdgesAgree(fit, input))
      out->push_back({fit, log_prior + LogTarget(fit, input)});
  }
}

std::optional<FitResult> Localiser::JoinedReading(FitInput* input) const {
  const double log_clutter = LogClutter(*input);
  auto whole = WholeReading(input);
  if (whole && whole->prior_distance < kClear) {
    whole->log_odds = LogTarget(*whole, *input) - log_clutter;
    return whole;
  }
  std::vector<Hypothesis> all;
  // Where the range is not known, two opposite sides must give it.
  const bool known = RangeSigma(*input) < kKnownRange;
  Weigh(*input, std::log(1.0 - kSharpTurn), known ? kReadings.size() : kOneHidden, &all);
  FitInput turned = *input;
  turned.prior = AfterASharpTurn(*input);
  Weigh(turned, std::log(kSharpTurn), kOneHidden, &all);
  if (all.empty()) return std::nullopt;
  FitResult fit = Joined(all);
  fit.log_odds -= log_clutter;
  return fit;
}

std::optional<FitResult> Localiser::Correct(const FitInput& predicted,
                                            const Clusters& clusters) const {
  if (!Visible(predicted)) return std::nullopt;
  FitInput input = predicted;
  const double gate = config_.fit.lidar_gate + 2.0 * RangeSigma(predicted);
  const double all = CountPoints(clusters);
  const auto unexplained = [&](double explained) {
    return std::min(kMostUnexplained, kUnexplained * (all - explained));
  };
  // What stands before the target may lend the blob's edge a few points, and what stands behind it
  // too: the fit that explains most of them is taken.
  std::optional<FitResult> best;
  double best_score = 0.0;
  int tried = 0;
  for (const auto& cluster : clusters) {
    input.points = PointsOnTarget(predicted, cluster, gate);
    if (input.points.empty()) continue;
    if (++tried > kMostClusters) break;
    auto fit = JoinedReading(&input);
    if (!fit) continue;
    const double score = fit->log_odds - unexplained(static_cast<double>(cluster.size()));
    if (best && score <= best_score) continue;
    best = fit;
    best_score = score;
  }
  if (best) return best;
  input.points.clear();
  if (CountSeenThrough(predicted, clusters) >= kManyPoints) return std::nullopt;
  best = JoinedReading(&input);
  if (best) best->log_odds -= unexplained(0.0);
  return best;
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
    if (!detection.p_CT && std::count(fit->used.begin(), fit->used.end(), true) < kSidesOfNew)
      return false;
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
