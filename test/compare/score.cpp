#include "test/compare/score.h"

#include <algorithm>
#include <cmath>

#include "common/world/separation.h"
#include "services/planning/separations.h"

namespace chase::compare {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// Index of the first obstacle whose ellipsoid meets the segment p q; -1: none.
int Meets(const Mission& mission, const std::vector<Eigen::Matrix3d>& shapes, const Vector3d& p,
          const Vector3d& q) {
  for (size_t j = 0; j < shapes.size(); ++j)
    if (world::SegmentSquaredDistance(p, q, mission.obstacles[j].center.coefficients.row(0),
                                      shapes[j]) <= 1.0)
      return static_cast<int>(j);
  return -1;
}

/// Planar distance of the segment p q to the nearest obstacle's surface, m.
double PlanarClearance(const Mission& mission, const Vector3d& p, const Vector3d& q) {
  double least = HUGE_VAL;
  for (const world::Obstacle& o : mission.obstacles) {
    const Vector2d c = o.center.coefficients.row(0).head<2>().transpose();
    const Vector2d a = p.head<2>(), u = (q - p).head<2>();
    const double s =
        u.squaredNorm() > 0.0 ? std::clamp((c - a).dot(u) / u.squaredNorm(), 0.0, 1.0) : 0.0;
    least = std::min(least, (a + s * u - c).norm() - 1.0 / std::sqrt(o.shape(0, 0)));
  }
  return least;
}

class Lapses {
 public:
  Lapses(std::string what, const Rollout& rollout) : what_(std::move(what)), rollout_(rollout) {}

  void Add(double t, int obstacle) {
    if (obstacle < 0) {
      open_ = false;
      return;
    }
    if (!open_) found_.push_back({what_, t, t, obstacle, PlanAt(t)});
    open_ = true;
    found_.back().to = t;
  }
  const std::vector<Lapse>& found() const { return found_; }

 private:
  std::string PlanAt(double t) const {
    const Replan* flown = &rollout_.replans.front();
    for (const Replan& r : rollout_.replans)
      if (r.t < t - 1e-9) flown = &r;
    return std::string(planning::Name(flown->verdict)) +
           (flown->reason.empty() ? "" : ": " + flown->reason);
  }

  std::string what_;
  const Rollout& rollout_;
  std::vector<Lapse> found_;
  bool open_ = false;
};

Times TimesOf(std::vector<double> ms) {
  std::sort(ms.begin(), ms.end());
  const auto at = [&](double share) {
    return ms[static_cast<size_t>(share * static_cast<double>(ms.size() - 1) + 0.5)];
  };
  double sum = 0.0;
  for (double v : ms) sum += v;
  return {sum / static_cast<double>(ms.size()), at(0.5), at(0.95), at(0.99), ms.back()};
}

void JudgePlanning(const Rollout& rollout, Score* score) {
  std::vector<double> wall, cpu;
  for (const Replan& r : rollout.replans) {
    wall.push_back(r.wall_ms);
    cpu.push_back(r.cpu_ms);
    ++score->verdicts[planning::Name(r.verdict)];
    score->fallbacks +=
        r.verdict != planning::Verdict::kChase && r.verdict != planning::Verdict::kWider;
  }
  score->plan_ms = TimesOf(wall);
  score->plan_cpu_ms = TimesOf(cpu);
  score->replans = static_cast<long>(rollout.replans.size());
}

void JudgeSight(const Mission& mission, const Rollout& rollout, Score* score) {
  const auto grown = mission.GrownShapes();
  std::vector<Eigen::Matrix3d> bare;
  for (const auto& o : mission.obstacles) bare.push_back(o.shape);
  Lapses touches("touches", rollout), hidden("hidden", rollout);
  long safe = 0, visible = 0, physical = 0;
  score->min_clearance_m = score->min_sight_clearance_m = HUGE_VAL;
  for (const Sample& s : rollout.samples) {
    const Vector3d& p = s.chaser.p;
    const int touched = Meets(mission, grown, p, p), hides = Meets(mission, grown, p, s.target);
    touches.Add(s.t, touched);
    hidden.Add(s.t, hides);
    safe += touched < 0;
    visible += hides < 0;
    physical += hides < 0 || Meets(mission, bare, p, s.target) < 0;
    score->min_clearance_m =
        std::min(score->min_clearance_m, PlanarClearance(mission, p, p) - mission.drone_radius);
    score->min_sight_clearance_m =
        std::min(score->min_sight_clearance_m, PlanarClearance(mission, p, s.target));
  }
  const double n = static_cast<double>(rollout.samples.size());
  score->safe_ratio = static_cast<double>(safe) / n;
  score->visible_ratio = static_cast<double>(visible) / n;
  score->visible_ratio_physical = static_cast<double>(physical) / n;
  score->lapses = touches.found();
  score->lapses.insert(score->lapses.end(), hidden.found().begin(), hidden.found().end());
}

double YawRate(const Sample& s) {
  const Vector3d r = s.target - s.chaser.p, v = s.target_velocity - s.chaser.v;
  return (r.x() * v.y() - r.y() * v.x()) / std::max(r.head<2>().squaredNorm(), 1e-4);
}

void JudgeMotion(const Mission& mission, const Rollout& rollout, Score* score) {
  const double n = static_cast<double>(rollout.samples.size());
  double travelled = 0.0, driven = 0.0;
  score->min_height = HUGE_VAL;
  for (size_t i = 0; i < rollout.samples.size(); ++i) {
    const Sample& s = rollout.samples[i];
    const double ratio = (s.chaser.p - s.target).norm() / mission.desired_distance;
    score->distance_ratio += ratio / n;
    score->distance_error += std::abs(ratio - 1.0) / n;
    score->acceleration_cost += s.chaser.a.squaredNorm() / n;
    score->jerk_cost += s.chaser.j.squaredNorm() / n;
    score->yaw_rate_rms += YawRate(s) * YawRate(s) / n;
    score->peak_speed = std::max(score->peak_speed, s.chaser.v.norm());
    score->peak_acceleration = std::max(score->peak_acceleration, s.chaser.a.norm());
    score->min_height = std::min(score->min_height, s.chaser.p.z());
    score->max_height = std::max(score->max_height, s.chaser.p.z());
    if (i == 0) continue;
    travelled += (s.chaser.p - rollout.samples[i - 1].chaser.p).norm();
    driven += (s.target - rollout.samples[i - 1].target).norm();
  }
  score->yaw_rate_rms = std::sqrt(score->yaw_rate_rms);
  score->travel_ratio = driven > 0.0 ? travelled / driven : 0.0;
}

bool IsProvedSafe(const Mission& mission, const Rollout& rollout) {
  for (size_t k = 0; k < rollout.replans.size(); ++k) {
    const double from = rollout.replans[k].t;
    const double to = k + 1 < rollout.replans.size() ? rollout.replans[k + 1].t : mission.duration;
    for (const world::Trajectory& piece : rollout.replans[k].flown) {
      const double a = std::max(from, piece.start), b = std::min(to, piece.end());
      if (b - a < 1e-9) continue;
      const world::Ball drone =
          planning::DroneBall(planning::ToCurve(piece, a, b - a), mission.drone_radius);
      for (const world::Obstacle& o : mission.obstacles)
        if (world::Separate(drone, nullptr, world::MakeBody(o, a, b - a, 0.0)).kept !=
            world::Kept::kOff)
          return false;
    }
  }
  return true;
}

}  // namespace

Score Judge(const Mission& mission, const Rollout& rollout) {
  Score score;
  JudgePlanning(rollout, &score);
  JudgeSight(mission, rollout, &score);
  JudgeMotion(mission, rollout, &score);
  score.proved_safe = IsProvedSafe(mission, rollout);
  return score;
}

}  // namespace chase::compare
