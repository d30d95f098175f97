#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/perception/belief/target_track.h"
#include "services/perception/place/localiser.h"
#include "services/perception/place/search_boxes.h"
#include "services/perception/place/target_points.h"

namespace chase::perception {

/// One camera frame. `problem` says why there is no usable image in it; else empty.
struct Frame {
  double t = 0.0;  ///< middle of the exposure, s
  cv::Mat bgr;     ///< 8 bit, 3 channels
  std::string problem;
};

/// What one frame offers.
struct View {
  double t;
  PoseSample pose;
  Camera camera;
  cv::Mat bgr;
  std::vector<Detection> detections;
  std::vector<bool> taken;  ///< by detection: belongs to something found already
};

/// One thing found in one frame.
struct Sighting {
  FitResult fit;
  Detection detection;

  /// True when nothing of it is left out, nor cut off.
  bool AllSeen() const;
  /// True when LiDAR points tell that it is one thing.
  bool SurelyHit() const { return fit.n_points >= kSurelyHit; }
  /// True when all of it is seen, on its own, and LiDAR points tell where it is.
  bool Clear() const { return fit.whole && SurelyHit() && !detection.part && !detection.AnyCut(); }
};

/// Keeps poses and sweeps; finds a given thing, or a new one, in a frame.
class Finder {
 public:
  /// Throws std::runtime_error when the detector's file or name is not usable.
  explicit Finder(const PerceptionConfig& config);

  /// Another target from now on; poses and sweeps stay. Throws as the constructor does.
  void SetDetector(const DetectorConfig& detector);

  void AddPose(const PoseSample& pose) { poses_.Add(pose); }
  void AddSweep(const Sweep& sweep);
  const PoseHistory& poses() const { return poses_; }

  /// The frame's detections, or nothing with `note` saying why.
  std::optional<View> Look(const Frame& frame, std::string* note) const;

  /// True for a sighting that belongs to something else.
  using Refuses = std::function<bool(const Sighting&)>;
  /// The detection that the track explains best; it is marked as taken.
  std::optional<Sighting> Find(const TargetTrack& track, View* view, const Refuses& refuses) const;
  /// One detection as the thing of a track. Points already used may be asked for again.
  std::optional<Sighting> Try(const TargetTrack& track, const View& view,
                              const Detection& detection, bool fresh_sweeps_only) const;
  /// One detection as a target of which nothing is known.
  std::optional<Sighting> Acquire(const View& view, const Detection& detection) const;
  bool HasSweeps() const { return !sweeps_.empty(); }
  /// Sweeps count once: those that a frame at t [s] could see.
  void MarkSweepsUsed(double t);

 private:
  struct KeptSweep {
    Sweep sweep;
    bool used = false;
  };

  std::optional<Sighting> Best(const TargetTrack& track, const View& view,
                               const std::vector<size_t>& inside, const Refuses& refuses,
                               const SearchBoxes& boxes) const;
  void WeighHidden(const View& view, FitInput input, FitResult* fit) const;
  Clusters Points(const View& view, const Detection& detection, const Eigen::Vector3d& v_WT,
                  bool fresh_only) const;

  PerceptionConfig config_;
  std::unique_ptr<Detector> detector_;
  Localiser localiser_;
  TargetShape shape_;
  PoseHistory poses_;
  std::deque<KeptSweep> sweeps_;
};

}  // namespace chase::perception
