#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/perception/localiser.h"
#include "services/perception/target_track.h"

namespace chase::perception {

enum class TargetState { kSearching, kTracking, kOccluded, kLost };

/// One camera frame. `problem` says why there is no usable image in it; else empty.
struct Frame {
  double t = 0.0;  ///< middle of the exposure, s
  cv::Mat bgr;     ///< 8 bit, 3 channels
  std::string problem;
};

/// The target at a frame's time as a Gaussian of its centre.
struct TargetEstimate {
  double t = 0.0;  ///< s
  TargetState state = TargetState::kSearching;
  Eigen::Vector3d p_WT = Eigen::Vector3d::Zero();            ///< frame W, m
  Eigen::Vector3d v_WT = Eigen::Vector3d::Zero();            ///< frame W, m/s
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Identity();  ///< of p_WT, m^2
  Eigen::Vector2d size = Eigen::Vector2d::Zero();            ///< radius, height, m
  cv::Rect2d box;                                            ///< px; empty: not seen
  double score = 0.0;                                        ///< of the detection, 0 to 1
  int n_points = 0;                                          ///< LiDAR points used
  std::string note;                                          ///< what was missing; else empty
};

/// Finds the target, follows it and says how sure it is. Feed it poses and sweeps as they come and
/// ask with each frame.
class Perceiver {
 public:
  /// Throws std::runtime_error when the detector's file or name is not usable.
  explicit Perceiver(const PerceptionConfig& config);

  void AddPose(const PoseSample& pose) { poses_.Add(pose); }
  void AddSweep(Sweep sweep);
  TargetEstimate See(const Frame& frame);

  const PoseHistory& poses() const { return poses_; }

 private:
  /// What one frame offers.
  struct View {
    double t;
    PoseSample pose;
    Camera camera;
    cv::Mat bgr;
    std::vector<Detection> detections;
    std::vector<bool> taken;
  };
  struct KeptSweep {
    Sweep sweep;
    bool used = false;
  };
  struct Sighting {
    FitResult fit;
    Detection detection;
    int n_points = 0;
  };
  struct Decoy {
    Eigen::Vector3d p_W, start;  ///< now and when first seen, frame W, m
    double t;                    ///< last seen, s
    int hits;
  };

  std::optional<View> Look(const Frame& frame, std::string* note) const;
  void Follow(View* view);
  void Seek(View* view);
  void Remember(const View& view);
  void Promote(double t);
  void Judge(double t);
  TargetEstimate Report(double t, const std::optional<View>& view, std::string note) const;

  std::optional<Sighting> Find(const TargetTrack& track, View* view, bool fresh_sweeps_only);
  std::optional<Sighting> Try(const TargetTrack& track, const View& view,
                              const Detection& detection, bool fresh_sweeps_only) const;
  std::optional<Sighting> AcquireFrom(const View& view, const Detection& detection) const;
  Clusters Points(const View& view, const Detection& detection, const Eigen::Vector3d& v_WT,
                  bool fresh_only) const;
  bool Plausible(const Eigen::Vector3d& p_WT, double t) const;
  const Decoy* DecoyAt(const Eigen::Vector3d& p_WT) const;
  bool IsRatherDecoy(const Sighting& s, const View& view, const Detection& detection) const;
  void NoteDecoy(const Sighting& s, double t);
  void ForgetIfTimeRanBack(double t);

  PerceptionConfig config_;
  std::unique_ptr<Detector> detector_;
  Localiser localiser_;
  TargetShape shape_;
  PoseHistory poses_;
  std::deque<KeptSweep> sweeps_;
  TargetState state_ = TargetState::kSearching;
  std::optional<TargetTrack> track_, candidate_;
  std::optional<Sighting> sighting_;  ///< of the last frame
  std::vector<Decoy> decoys_;
  size_t turn_ = 0;                                  ///< detection that is looked at next
  Eigen::Vector3d start_ = Eigen::Vector3d::Zero();  ///< where the track began, frame W, m
  double last_t_ = -1e18;
};

}  // namespace chase::perception
