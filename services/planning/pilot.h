#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "common/world/geofence.h"
#include "services/planning/pilot_inputs.h"
#include "services/planning/planner.h"
#include "services/planning/planning_config.h"
#include "services/planning/target_search.h"
#include "services/planning/tube.h"
#include "services/planning/way_back.h"
#include "services/planning/way_down.h"

namespace chase::planning {

/// What a mission process wants.
enum class Task {
  kGround,   ///< nothing is flown; in the air: as kHold
  kTakeoff,  ///< climb, then hover
  kChase,    ///< the target, or look for it
  kHold,     ///< brake and hover
  kReturn,   ///< to above the take-off place
  kLand,     ///< to above level ground; control comes down from there
  kDone,     ///< nothing is flown any more
};

/// Decides when to plan, from which state, and what to fly when there is nothing to chase: climb,
/// hover, brake, look around. Keeps the plan being flown.
class Pilot {
 public:
  explicit Pilot(const PlanningConfig& config);

  void SetForecast(const Forecast& forecast);
  void SetObstacles(double t, std::vector<world::Obstacle> obstacles);
  /// Places near the drone that nobody has looked into; once heard they go stale as obstacles do.
  void SetUnseen(double t, std::vector<world::Obstacle> unseen);
  /// At `t` [s] a list came from somebody who tells of them too: until the first are heard nothing
  /// counts as seen, but for logs of mappings that told of none.
  void ExpectUnseen(double t) { expected_since_ = expected_since_.value_or(t); }
  /// Control says that it flies: a planner that has just been started must not take off again.
  void SetFlying(bool flying) {
    heard_control_ = true;
    flies_ = flying;
    airborne_ = airborne_ || (flying && !has_running_);
  }

  /// How far control says at `t` [s] the body strays from what it follows, m: the tube about plans
  /// holds that and the deviation of the estimate's place. Once heard it goes stale.
  void SetTrackingBound(double t, double bound);
  /// Of the drone's sphere and the tube about the newest plan, m.
  double hard_radius() const { return config_.planner.drone_radius + tube_.radius; }

  /// What it knows is not enough to take off yet, or the autopilot does not obey: a climb waits.
  void SetWaiting(bool waiting) { waits_ = waiting; }

  /// Control says that it comes down: nothing leads it aside any more.
  void SetDescending(bool descending) { descending_ = descending; }

  /// Until the first one it climbs and chases by itself. `home` is p_WB where it took off, frame W,
  /// m; nothing: not known.
  void SetTask(Task task, const std::optional<Eigen::Vector3d>& home);

  /// Ways back and down keep to it. It counts from `home`: where that is not known there is none.
  void SetFence(world::Geofence fence) { fence_ = std::move(fence); }

  /// Forgets all that was said in the frame W that was: forecast, obstacles, the running plan.
  void ChangeFrame();

  /// A new plan if one is due at time t [s]; it starts `latency` later.
  std::optional<PlanResult> Update(double t, const BodyEstimate& body);

  const PlanResult& running() const { return running_; }
  const std::optional<Forecast>& forecast() const { return forecast_; }
  int n_obstacles() const { return static_cast<int>(obstacles_.size()); }

 private:
  struct Start {
    world::State state;
    YawStart yaw;
    bool on_plan = false;  ///< taken from the running plan, not from its stop or the estimate
    bool follows = true;   ///< the body was within the tube about what is flown
  };

  bool IsDue(double t) const;
  bool MayPlan(double t) const;
  bool Chases() const { return !task_ || *task_ == Task::kChase; }
  bool HasTarget(double t) const;
  Start StartAt(double t, double t0, const BodyEstimate& body) const;
  const world::Trajectory& FlownAt(double t) const;
  PlanRequest Request(double t0, const Start& start) const;
  PlanResult Chase(double t0, const Start& start);
  PlanResult Wait(double t0, const Start& start, const BodyEstimate& body);
  PlanResult Climb(double t0, const BodyEstimate& body) const;
  bool IsFree(double t0, const Start& start, const world::Trajectory& climb) const;
  PlanResult ClimbOn(double t0, const Start& start, const BodyEstimate& body);
  PlanResult Hover(double t0, const Start& start);
  PlanResult Rest(double t0, const Start& start) const;
  PlanResult RestWithoutLists(PlanRequest request) const;
  PlanResult Obey(double t0, const Start& start, const BodyEstimate& body);
  PlanResult Hold(double t0, const Start& start, const std::string& reason) const;
  PlanResult Return(double t0, const Start& start, const BodyEstimate& body);
  PlanResult Land(double t0, const Start& start, const BodyEstimate& body);
  MayFly InFence(const Eigen::Vector3d& p_WB) const;
  bool IsInFence(const Eigen::Vector3d& p_WB, const PlanResult& plan) const;
  PlanResult Along(const PlanRequest& request, const Start& start, Stop leg, const MayFly& may_fly,
                   const std::string& reason) const;
  bool SeesObstacles(double t) const;
  double TrackingBound(double t) const;
  PlanResult Search(double t0, const Start& start, const BodyEstimate& body);
  PlanResult BrakeAndLook(double t0, const Start& start, double yaw) const;

  PlanningConfig config_;
  std::unique_ptr<Planner> planner_;
  std::optional<Forecast> forecast_;
  std::vector<world::Obstacle> obstacles_, unseen_;
  double obstacles_time_ = -1e9;                        ///< s
  std::optional<double> unseen_time_, expected_since_;  ///< s
  PlanResult running_;
  bool has_running_ = false;
  Tube tube_;
  std::optional<double> tracking_time_;  ///< s
  double tracking_bound_ = 0.0;          ///< m
  double last_planned_ = -1e9;
  bool news_ = false;
  bool airborne_ = false;
  bool heard_control_ = false, flies_ = false, descending_ = false, waits_ = false;
  double climb_end_ = 0.0;
  bool chased_ = false;                       ///< in any frame
  std::optional<double> hovers_since_;        ///< s, with nobody seen in this one
  std::optional<Eigen::Vector3d> climb_top_;  ///< p_WB, m
  std::optional<Task> task_;
  std::optional<Eigen::Vector3d> home_;  // m
  world::Geofence fence_;
  Trail trail_;
  WayBack way_back_;
  WayDown way_down_;
  TargetSearch search_;
};

}  // namespace chase::planning
