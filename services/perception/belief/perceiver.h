#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "services/perception/belief/finder.h"
#include "services/perception/belief/track.h"

namespace chase::perception {

enum class TargetState { kSearching, kTracking, kOccluded, kLost };

/// Why a detection was not taken for a new target, worst first.
enum class Refusal { kTooSmall, kWrongShape, kNoRange, kContradicted };
inline constexpr size_t kRefusals = 4;
inline constexpr std::array<const char*, kRefusals> kWhyRefused = {
    "too small", "of another aspect, fill or colour", "no LiDAR, and the size tells no range",
    "outline, size and LiDAR contradict each other"};
/// Detections by Refusal.
using Refused = std::array<int64_t, kRefusals>;

/// The target at a frame's time as a Gaussian of its centre.
struct TargetEstimate {
  TargetState state = TargetState::kSearching;
  Eigen::Vector3d p_WT = Eigen::Vector3d::Zero();                     ///< frame W, m
  Eigen::Vector3d v_WT = Eigen::Vector3d::Zero();                     ///< frame W, m/s
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();           ///< of p_WT, m^2
  Eigen::Matrix3d velocity_covariance = Eigen::Matrix3d::Identity();  ///< of v_WT, m^2/s^2
  Eigen::Vector2d size = Eigen::Vector2d::Zero();                     ///< radius, height, m
  cv::Rect2d box;                                                     ///< px; empty: not seen
  double score = 0.0;                                                 ///< of the detection, 0 to 1
  int n_points = 0;                                                   ///< LiDAR points used
  double unseen = 0.0;                                                ///< since it was seen last, s
  std::string note;      ///< what was missing; else empty
  Refused refused = {};  ///< detections of this frame that no track was started from

  /// Probability that the target stands within half a metre of p_WT, as the covariance tells.
  double Existence() const;
};

/// What stood where it was seen when something else was taken for the target.
struct LookAlike {
  Eigen::Vector3d p_W;  ///< frame W, m
  double t;             ///< when, s
};

/// Finds the target, follows it and says how sure it is. Feed it poses and sweeps as they come and
/// ask with each frame.
class Perceiver {
 public:
  /// Throws std::runtime_error when the detector's file or name is not usable.
  explicit Perceiver(const PerceptionConfig& config);

  void AddPose(const PoseSample& pose) { finder_.AddPose(pose); }
  void AddSweep(const Sweep& sweep) { finder_.AddSweep(sweep); }
  TargetEstimate See(const Frame& frame);

  /// Somebody has pointed at the target, at pixel (u, v) `at` of the last frame: what the detector
  /// finds there within a second is taken at once, whatever was followed before.
  void Select(const DetectorConfig& detector, const Eigen::Vector2d& at);

 private:
  void Follow(View* view);
  void Seek(View* view);
  void TakeSelected(View* view);
  void FollowCandidates(View* view);
  void AddCandidates(View* view);
  void DropMissed();
  void Confirm(const View& view);
  void Judge(double t);
  TargetEstimate Report(double t, const std::optional<View>& view, std::string note) const;

  void CountRefused(const Detection& d);
  bool Expected(const Sighting& s) const;
  bool Ready(const Track& candidate, double t) const;
  bool MayBeTarget(const Sighting& s, double t) const;
  void Start(const Track& track);
  bool ForgetIfTimeRanBack(double t);
  void Forget();

  PerceptionConfig config_;
  Finder finder_;
  TargetState state_ = TargetState::kSearching;
  std::optional<Track> track_;     ///< the target
  std::vector<Track> candidates_;  ///< what else may be it
  bool sighted_ = false;           ///< in the last frame
  std::deque<LookAlike> look_alikes_;
  std::optional<Eigen::Vector2d> selected_;    ///< px, not taken yet
  Refused refused_ = {};                       ///< in this frame
  double last_t_ = -1e18, selected_at_ = 0.0;  ///< s
};

}  // namespace chase::perception
