#include <algorithm>
#include <cmath>

#include "services/mapping/assignment.h"
#include "services/mapping/movers.h"

namespace chase::mapping {

namespace {

constexpr double kThinnest = 0.1;       // m, half width of a mover at least
constexpr double kFirstSpeed = 2.0;     // m/s, standard deviation of an unknown velocity
constexpr double kTentativeGap = 0.25;  // s that an unconfirmed track may go unseen
constexpr double kTentativeAge = 0.8;   // s after which an unconfirmed track does not count
constexpr double kRestSpeed = 0.25;     // m/s
constexpr double kPartShare = 0.9;      // of the known length: seen less, it is half hidden
constexpr double kPartReach = 1.3;      // factor of the outline within which its part must lie
constexpr double kPartTime = 2.0;       // s, longest belief in that
constexpr double kForgetLength = 0.98;  // per sweep
constexpr size_t kMostTracks = 64;

}  // namespace

Ellipse Track::Outline() const {
  if (hull.empty()) return {p.head<2>(), Eigen::Matrix2d::Identity()};
  Ellipse e = SmallestEllipse(hull, 0.01, kThinnest);
  double reach = 1.0;
  e.center.setZero();
  for (const auto& q : hull) reach = std::max(reach, e.Level(q));
  return {p.head<2>(), e.shape / reach};
}

double Track::Radius() const {
  double radius = 0.0;
  for (const auto& q : hull) radius = std::max(radius, q.norm());
  return radius;
}

void Tracker::Predict(double t) {
  const double dt = std::clamp(t - t_, 0.0, 1.0);
  t_ = t;
  for (auto& track : tracks_) {
    track.p += dt * track.v;
    const double q = config_.acceleration * config_.acceleration;
    track.pp += 2.0 * dt * track.pv + dt * dt * track.vv + 0.25 * q * std::pow(dt, 4);
    track.pv += dt * track.vv + 0.5 * q * std::pow(dt, 3);
    track.vv += q * dt * dt;
  }
}

std::vector<Ellipse> Tracker::Expected() const {
  std::vector<Ellipse> outlines;
  for (const auto& track : tracks_)
    if (track.confirmed && t_ - track.seen < config_.coast)
      outlines.push_back(track.Outline().Scaled(1.15));
  return outlines;
}

/// Parts of one mover that something in front of it separates belong together.
void Tracker::Join(std::vector<Cluster>* clusters) const {
  for (const auto& track : tracks_) {
    if (!track.confirmed) continue;
    const Ellipse outline = track.Outline().Scaled(1.2);
    Cluster* first = nullptr;
    for (auto& cluster : *clusters) {
      if (cluster.members.empty() || outline.Level(cluster.center.head<2>()) > 1.0) continue;
      if (!first) {
        first = &cluster;
        continue;
      }
      first->members.insert(first->members.end(), cluster.members.begin(), cluster.members.end());
      first->hull.insert(first->hull.end(), cluster.hull.begin(), cluster.hull.end());
      first->hull = ConvexHull(first->hull);
      const Rectangle box = SmallestRectangle(first->hull);
      first->center.head<2>() = box.center;
      first->half_length = box.half.x();
      cluster.members.clear();
    }
  }
  clusters->erase(std::remove_if(clusters->begin(), clusters->end(),
                                 [](const Cluster& c) { return c.members.empty(); }),
                  clusters->end());
}

/// Shorter than it is known to be, and where it is expected: something in front hides the rest, and
/// its centre says nothing. Not believed for long.
bool Tracker::HalfHidden(const Cluster& cluster, const Track& track) const {
  if (!track.confirmed || cluster.half_length > kPartShare * track.half_length) return false;
  return t_ - track.whole < kPartTime &&
         track.Outline().Scaled(kPartReach).Level(cluster.center.head<2>()) < 1.0;
}

void Tracker::Correct(const Cluster& cluster, Track* track) const {
  track->seen = t_;
  ++track->detections;
  if (HalfHidden(cluster, *track)) return;
  track->whole = t_;
  const double s = track->pp + config_.measurement * config_.measurement;
  const double kp = track->pp / s, kv = track->pv / s;
  const Eigen::Vector3d innovation = cluster.center - track->p;
  track->p += kp * innovation;
  track->v += kv * innovation;
  track->vv -= kv * track->pv;
  track->pv *= 1.0 - kp;
  track->pp *= 1.0 - kp;
  track->half_length = std::max(cluster.half_length, kForgetLength * track->half_length);
  track->hull.clear();
  for (const auto& q : cluster.hull) track->hull.push_back(q - track->p.head<2>());
}

void Tracker::Confirm(Track* track) const {
  track->fresh = false;
  const double speed = track->v.head<2>().norm();
  if (speed > kRestSpeed) track->moved = t_;
  if (track->confirmed) return;
  track->trail.push_back(track->p.head<2>());
  const double travel = (track->p - track->birth).head<2>().norm();
  track->confirmed = track->detections >= config_.confirm_sweeps &&
                     speed >= config_.confirm_speed && travel >= config_.confirm_distance;
  track->fresh = track->confirmed;
}

void Tracker::Birth(Cluster* cluster) {
  if (tracks_.size() >= kMostTracks) return;
  Track track;
  track.id = next_id_;
  next_id_ = next_id_ == INT32_MAX ? 1 << 30 : next_id_ + 1;
  track.p = track.birth = cluster->center;
  track.pp = config_.measurement * config_.measurement;
  track.vv = kFirstSpeed * kFirstSpeed;
  track.born = track.seen = track.moved = track.whole = t_;
  track.detections = 1;
  track.half_length = cluster->half_length;
  for (const auto& q : cluster->hull) track.hull.push_back(q - cluster->center.head<2>());
  track.trail.push_back(track.p.head<2>());
  cluster->track = track.id;
  tracks_.push_back(std::move(track));
}

void Tracker::Update(std::vector<Cluster>* clusters) {
  Join(clusters);
  Eigen::MatrixXd cost(tracks_.size(), clusters->size());
  const double gate = config_.gate * config_.gate;
  for (size_t i = 0; i < tracks_.size(); ++i) {
    const double s = tracks_[i].pp + config_.measurement * config_.measurement;
    for (size_t j = 0; j < clusters->size(); ++j)
      cost(static_cast<int>(i), static_cast<int>(j)) =
          ((*clusters)[j].center - tracks_[i].p).head<2>().squaredNorm() / s;
  }
  const auto assigned = Assign(cost, gate);
  for (size_t i = 0; i < tracks_.size(); ++i) {
    Track& track = tracks_[i];
    track.fresh = false;
    if (assigned[i] < 0) continue;
    Cluster& cluster = (*clusters)[static_cast<size_t>(assigned[i])];
    cluster.track = track.id;
    Correct(cluster, &track);
    Confirm(&track);
  }
  Bury();
  for (auto& cluster : *clusters)
    if (cluster.track < 0) Birth(&cluster);
}

void Tracker::Bury() {
  const auto dead = [this](const Track& track) {
    const double gap = t_ - track.seen;
    if (!track.confirmed) return gap > kTentativeGap;
    return gap > config_.coast || t_ - track.moved > config_.settle + gap;
  };
  tracks_.erase(std::remove_if(tracks_.begin(), tracks_.end(), dead), tracks_.end());
}

void Tracker::Forget(const Eigen::Vector2d& center, double radius) {
  tracks_.erase(std::remove_if(tracks_.begin(), tracks_.end(),
                               [&](const Track& track) {
                                 return (track.p.head<2>() - center).norm() < radius;
                               }),
                tracks_.end());
}

bool Tracker::Moves(int id) const {
  for (const auto& track : tracks_)
    if (track.id == id) return track.confirmed || t_ - track.born < kTentativeAge;
  return false;
}

std::vector<world::Obstacle> Tracker::Obstacles(double middle, double semi_height,
                                                double grow) const {
  std::vector<world::Obstacle> obstacles;
  for (const auto& track : tracks_) {
    if (!track.confirmed || t_ - track.seen > config_.coast_listed) continue;
    world::Obstacle o;
    o.id = track.id;
    o.moving = true;
    o.center.start = t_;
    o.center.duration = config_.horizon;
    o.center.coefficients.resize(2, 3);
    o.center.coefficients.row(0) << track.p.x(), track.p.y(), middle;
    o.center.coefficients.row(1) << config_.horizon * track.v.x(), config_.horizon * track.v.y(),
        0.0;
    o.shape.setZero();
    o.shape.topLeftCorner<2, 2>() = track.Outline().Scaled(grow).shape;
    o.shape(2, 2) = 1.0 / (semi_height * semi_height);
    o.position_variance = track.pp;
    o.velocity_variance = track.vv;
    obstacles.push_back(o);
  }
  return obstacles;
}

}  // namespace chase::mapping
