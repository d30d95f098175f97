#include "logs/src/estimate_errors.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "common/math/rotation.h"

namespace chase::logs {
namespace {

using Eigen::Vector3d;

constexpr double kTimeTolerance = 1e-6;  // s
constexpr double kLargestGap = 0.1;      // s between truth samples to interpolate over

double Rmse(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  return std::sqrt((a - b).squaredNorm() / static_cast<double>(a.cols()));
}

/// Estimates and the truth of the same times, one column each.
struct Pairs {
  std::vector<Vector3d> estimate, truth;

  void Add(const Vector3d& e, const Vector3d& t) {
    estimate.push_back(e);
    truth.push_back(t);
  }
  static Eigen::Matrix3Xd Columns(const std::vector<Vector3d>& v) {
    return Eigen::Map<const Eigen::Matrix3Xd>(v.data()->data(), 3, static_cast<long>(v.size()));
  }
};

const TargetSample* NewestTarget(const std::vector<TargetSample>& targets, double t) {
  const auto after =
      std::upper_bound(targets.begin(), targets.end(), t + kTimeTolerance,
                       [](double time, const TargetSample& s) { return time < s.t; });
  const auto newest = std::find_if(std::make_reverse_iterator(after), targets.rend(),
                                   [](const TargetSample& s) { return s.known; });
  return newest == targets.rend() ? nullptr : &*newest;
}

/// From the true frame W to those of odometry. The first is the true one, as far as its error goes;
/// one that began anew in flight has its own origin and north.
class EpochFrames {
 public:
  explicit EpochFrames(const FlightRecord& record) {
    for (const PoseSample& pose : record.poses) {
      if (frames_.empty()) frames_[pose.epoch] = Eigen::Isometry3d::Identity();
      if (frames_.count(pose.epoch) > 0) continue;
      if (const auto truth = TruthAt(record.truth, pose.t))
        frames_[pose.epoch] = FrameAt(pose, *truth);
    }
  }
  /// A true place in that epoch's frame; nothing where no POSE tells. Without any POSE there is one
  /// frame.
  std::optional<Vector3d> Place(int32_t epoch, const Vector3d& p) const {
    if (frames_.empty()) return p;
    const auto frame = frames_.find(epoch);
    return frame == frames_.end() ? std::nullopt : std::optional<Vector3d>(frame->second * p);
  }

 private:
  std::map<int32_t, Eigen::Isometry3d> frames_;
};

/// Mean distance from the true target, `horizon` s after the predictions' start, to where
/// position(prediction, time) has it, m.
template <class F>
std::optional<double> MeanError(const FlightRecord& record, double horizon, F position) {
  const EpochFrames frames(record);
  double sum = 0.0;
  long count = 0;
  for (const PredictionSample& p : record.predictions) {
    const double t = p.t + horizon;
    if (!p.usable || !record.InMission(p.t) || t > p.target.end() + kTimeTolerance) continue;
    const auto truth = TruthAt(record.truth, t);
    const std::optional<Vector3d> expected = position(p, t);
    if (!truth || !expected) continue;
    const auto place = frames.Place(p.epoch, truth->target);
    if (!place) continue;
    sum += (*expected - *place).norm();
    ++count;
  }
  return count > 0 ? std::optional<double>(sum / static_cast<double>(count)) : std::nullopt;
}

}  // namespace

std::optional<TruePositions> TruthAt(const std::vector<TruthSample>& truth, double t) {
  const auto after = std::lower_bound(truth.begin(), truth.end(), t - kTimeTolerance,
                                      [](const TruthSample& s, double time) { return s.t < time; });
  if (after == truth.end()) return std::nullopt;
  if (std::abs(after->t - t) <= kTimeTolerance)
    return TruePositions{after->p, after->target, after->yaw};
  if (after == truth.begin()) return std::nullopt;
  const auto before = after - 1;
  const double gap = after->t - before->t;
  if (gap > kLargestGap) return std::nullopt;
  const double s = (t - before->t) / gap;
  return TruePositions{before->p + s * (after->p - before->p),
                       before->target + s * (after->target - before->target),
                       before->yaw + s * math::WrapAngle(after->yaw - before->yaw)};
}

Eigen::Isometry3d FrameAt(const PoseSample& pose, const TruePositions& truth) {
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  frame.linear() = Eigen::AngleAxisd(pose.yaw - truth.yaw, Vector3d::UnitZ()).toRotationMatrix();
  frame.translation() = pose.p - frame.linear() * truth.body;
  return frame;
}

TrajectoryError OdometryError(const FlightRecord& record) {
  const EpochFrames frames(record);
  Pairs pairs;
  for (const PoseSample& pose : record.poses) {
    const auto truth = TruthAt(record.truth, pose.t);
    if (!truth || !record.InMission(pose.t)) continue;
    if (const auto place = frames.Place(pose.epoch, truth->body)) pairs.Add(pose.p, *place);
  }
  if (pairs.estimate.empty()) return {};
  const auto estimate = Pairs::Columns(pairs.estimate), truth = Pairs::Columns(pairs.truth);
  TrajectoryError error;
  error.raw = Rmse(estimate, truth);
  if (estimate.cols() < 3) return error;
  const Eigen::Isometry3d fit(Eigen::umeyama(estimate, truth, false));
  error.aligned = Rmse(fit * estimate.colwise().homogeneous(), truth);
  return error;
}

std::optional<double> TargetRmse(const FlightRecord& record) {
  const EpochFrames frames(record);
  Pairs pairs;
  for (const TargetSample& target : record.targets) {
    if (!target.tracking || !record.InMission(target.t)) continue;
    const auto truth = TruthAt(record.truth, target.t);
    if (!truth) continue;
    if (const auto place = frames.Place(target.epoch, truth->target))
      pairs.Add(target.mean, *place);
  }
  if (pairs.estimate.empty()) return std::nullopt;
  return Rmse(Pairs::Columns(pairs.estimate), Pairs::Columns(pairs.truth));
}

std::optional<double> PredictionError(const FlightRecord& record, double horizon) {
  return MeanError(record, horizon,
                   [](const PredictionSample& p, double t) { return p.target.Position(t); });
}

std::optional<double> ConstantVelocityError(const FlightRecord& record, double horizon) {
  return MeanError(record, horizon, [&](const PredictionSample& p, double t) {
    const TargetSample* target = NewestTarget(record.targets, p.t);
    if (!target || target->epoch != p.epoch) return std::optional<Vector3d>();
    return std::optional<Vector3d>(target->mean + (t - target->t) * target->velocity);
  });
}

}  // namespace chase::logs
