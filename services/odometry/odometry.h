#pragma once

#include <algorithm>
#include <deque>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "services/odometry/deskew.h"
#include "services/odometry/imu_buffer.h"
#include "services/odometry/level_frame.h"
#include "services/odometry/odometry_config.h"
#include "services/odometry/spike_filter.h"
#include "services/odometry/standing.h"
#include "services/odometry/sweep_clock.h"

namespace chase::odometry {

/// The body as estimated at one instant. Frame W unless named otherwise.
struct PoseEstimate {
  double t = 0.0;  ///< s
  Pose X_WB;
  Eigen::Vector3d v = Eigen::Vector3d::Zero();           ///< m/s
  Eigen::Vector3d w_B = Eigen::Vector3d::Zero();         ///< frame B, rad/s
  Eigen::Vector3d a = Eigen::Vector3d::Zero();           ///< without gravity, m/s^2
  Eigen::Vector3d gyro_bias = Eigen::Vector3d::Zero();   ///< frame B, rad/s
  Eigen::Vector3d accel_bias = Eigen::Vector3d::Zero();  ///< frame B, m/s^2
  Eigen::Matrix<double, 9, 9> covariance = Eigen::Matrix<double, 9, 9>::Zero();  ///< p, v, theta
  /// The same against what the map holds, for what is kept in it: without the map's own error.
  Eigen::Matrix<double, 9, 9> local_covariance = Eigen::Matrix<double, 9, 9>::Zero();
  HealthReport health;
  bool correcting = false;
  int epoch = 0;  ///< changes whenever the map begins anew: W is another frame from then on
};

/// A sweep deskewed to its end.
struct RegisteredSweep {
  double t = 0.0;  ///< the sweep's end, s
  Pose X_WL;       ///< at that time
  Health health = Health::kOk;
  int epoch = 0;                         ///< of the frame W
  std::vector<float> x, y, z;            ///< frame W, m
  std::vector<uint8_t> intensity, ring;  ///< of the same points
};

struct SweepResult {
  std::optional<PoseEstimate> pose;  ///< only where no IMU carries the pose
  std::optional<RegisteredSweep> registered;
  MatchResult match;
  bool applied = false;  ///< the match corrected the state
};

/// LiDAR odometry fused with an IMU. The filter's state at the end of the last good sweep is kept;
/// each sweep advances it through the inertial samples, deskews, matches against the local map and
/// updates it; the newest state follows from there through the remaining samples. Works without
/// IMU.
class Odometry {
 public:
  explicit Odometry(const OdometryConfig& config);

  /// The pose at the sample's time; none for a sample that is out of order or not finite, nor for
  /// one that sweeps have led beyond.
  std::optional<PoseEstimate> AddImu(const ImuSample& imu);

  /// Queues a sweep. It waits until the IMU's samples reach its end, or until they stay away.
  void AddSweep(Sweep sweep);
  bool SweepReady() const;
  SweepResult ProcessSweep();

  /// True where neither samples nor sweeps have told until a sample of time t [s] how the body goes
  /// on, for so long that its attitude and place are anybody's guess: to be begun anew.
  bool Outdated(double t) const {
    constexpr double kLongest = 0.3, kRare = 0.2;  // s; at 1 rad/s and 4 m/s^2 17 degrees, 0.2 m
    const double silence = t - heard_;
    return fused_ && silence > kLongest &&
           static_cast<double>(ends_beyond_imu_.size()) < silence / kRare;
  }

  /// Does it move, or did when it was heard of last?
  bool Flies() const { return fused_ && !standing_.holds(); }

  int64_t dropped_sweeps() const { return dropped_sweeps_; }
  int64_t dropped_samples() const { return dropped_samples_; }
  size_t MapBytes() const { return planes_.MemoryBytes() + posts_.MemoryBytes(); }
  size_t map_cells() const { return planes_.cells() + posts_.cells(); }

 private:
  static constexpr double kWaitForImu = 0.08;  ///< s that a sweep may be ahead of the IMU
  static constexpr size_t kMostWaiting = 5;    ///< sweeps that wait for late samples: 0.5 s
  struct Pending {
    Sweep sweep;
    double imu_t;  // of the newest sample when the sweep came
    double end;    // of the last return, usable or not
  };
  struct Prepared {
    Sweep sweep;
    double end = 0.0;
    FeatureSet features;
    std::vector<int> matched_planes;
    NavState inertial;                    // at the sweep's end
    NavState predicted;                   // the same with what inertia may be off
    std::vector<NavState> track;          // from the last state to the sweep's end; for deskewing
    std::vector<Eigen::Vector3f> at_end;  // the points deskewed by the track: frame B at the end
  };

  /// The state before the first sweep that was processed without its samples, and those sweeps.
  struct Checkpoint {
    NavState base;
    Standing standing;
    LevelFrame level;
    MapDrift drift;
    CorrectionBlend blend;
    Matrix6d unknown;
    double held;
    std::optional<JumpHypothesis> jump;
    std::vector<Pending> sweeps;
    bool given_up = false;  ///< the samples: they are not waited for any more
  };

  void Take(const ImuSample& imu);
  bool SamplesAreLate() const { return fused_ && samples_late_ && sweeps_since_ < 2; }
  void SaveCheckpoint(const Pending& pending);
  void CloseCheckpoint(double t);
  void RollBack();
  bool IsProvisional() const { return checkpoint_ && !checkpoint_->given_up; }
  void Align(const ImuSample& imu);
  PoseEstimate AtPowerOn(double t);
  void Join(double t);
  void StartAtRest(double t);
  void StartInMotion(double t);
  bool SweepsShowMotion();
  void Follow(Pending pending, NavState placed);
  void Begin(double t);
  bool Aligns() const { return aligning_ && !started_; }
  double InitialYaw() const { return config_.initial_yaw_deg * M_PI / 180.0; }
  void StartBlind(double t);
  bool Prepare(Pending pending, Prepared* prepared);
  void Extract(Sweep sweep, Prepared* prepared);
  void Deskew(Prepared* prepared) const;
  Features FeaturesIn(const Prepared& prepared, const std::vector<Eigen::Vector3f>& points) const;
  std::vector<Eigen::Vector3f> Axes(const Prepared& prepared,
                                    const std::vector<Eigen::Vector3f>& points) const;
  Matrix6d PriorOf(const Prepared& prepared) const;
  MatchResult Match(Prepared* prepared);
  void MatchBlind(Prepared* prepared, MatchResult* match);
  void Bootstrap(Prepared* prepared, MatchResult* match);
  void PlaceFirst(const Pose& X_WB, const Eigen::Vector3d& v, const Eigen::Vector3d& w_B);
  void Bend(const Pose& X_WB, Prepared* prepared) const;
  bool Apply(const Prepared& prepared, MatchResult* match);
  bool Astray(const Prepared& prepared, const MatchResult& match) const;
  void Straighten(Prepared* prepared);
  static double Length(const Prepared& p) { return p.end - p.sweep.start; }  // s
  bool Extends(const MatchResult& match) const;
  void Learn(const Prepared& prepared, const Pose& X_WB);
  void FollowDrift(const MatchResult& match);
  void RestartMap();
  void PlaceMap(const NavState& state);
  void BeginMapHere();
  void ClearMap();
  static void PutAtOrigin(NavState* state);
  void CarryUnknown(const MatchResult& match, const NavState& prior);
  void HoldBetweenSweeps(double t);
  NavState Doubted(NavState state) const;
  void Catchup(bool lost = false);
  RegisteredSweep Registered(const Prepared& prepared) const;
  PoseEstimate Estimate() const;
  std::optional<PoseEstimate> NewEstimate();
  bool Blind(double end) const {
    return !fused_ || imu_.NewestUntil(end) < end - config_.health.imu_gap;
  }

  OdometryConfig config_;
  Pose X_BL_;
  ScanMatcher matcher_;
  SurfaceMap planes_, posts_;
  ImuBuffer imu_;
  SpikeFilter spikes_;
  SweepClock clock_;
  Alignment alignment_;
  Standing standing_;
  LevelFrame level_;
  MapDrift drift_;
  CorrectionBlend blend_;
  HealthMonitor health_;

  bool fused_ = false;    // the IMU carries the state
  bool started_ = false;  // there is a state at all
  bool aligning_ = false;
  NavState base_;  // at the end of the last sweep
  NavState live_;  // at the newest sample
  std::deque<Pending> pending_;
  std::optional<Checkpoint> checkpoint_;
  double newest_pose_ = -1e18, newest_registered_ = -1e18;  // that were published, s
  std::optional<Prepared> first_;  // of a start without IMU, until the velocity is known
  Thinning thinning_;
  int epoch_ = 0;
  int sweeps_learnt_ = 0;                // by the map
  Matrix6d unknown_ = Matrix6d::Zero();  // projector on what the last sweep left to inertia
  double began_ = std::numeric_limits<double>::infinity();  // the filter, s
  double held_ = 0.0;                    // last time that a sweep or standing held the state, s
  std::optional<JumpHypothesis> jump_;   // biases may have jumped: nothing is learnt
  int sweeps_since_ = 0;                 // the newest inertial sample came
  std::vector<double> ends_beyond_imu_;  // of the sweeps that end after that sample, s
  bool samples_late_ = false;            // behind the last sweep, by more than jitter
  double newest_sweep_ = -1e18;          // end of the sweep that came last, s
  double heard_ = -1e18;                 // of the newest inertial sample, used or not, s
  int64_t dropped_sweeps_ = 0, dropped_samples_ = 0;
};

}  // namespace chase::odometry
