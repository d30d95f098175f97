#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/perception/belief/track.h"
#include "services/perception/place/localiser.h"

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

  /// The detection that the track explains best; it is marked as taken.
  std::optional<Sighting> Find(const Track& track, View* view) const;
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

  std::optional<Sighting> Try(const Track& track, const View& view,
                              const Detection& detection) const;
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
