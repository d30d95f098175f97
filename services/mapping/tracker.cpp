#include "services/mapping/tracker.h"

#include <algorithm>
#include <cmath>

#include "services/mapping/assignment.h"

namespace chase::mapping {

namespace {

constexpr double kThinnest = 0.1;       // m, half width of a mover at least
constexpr double kFirstSpeed = 2.5;     // m/s, standard deviation of an unknown velocity
constexpr double kUnseen = 0.5;         // m, standard deviation of an end out of sight
constexpr double kTentativeGap = 0.25;  // s that an unconfirmed track may go unseen
constexpr double kTentativeAge = 0.8;   // s after which an unconfirmed track does not count
constexpr double kRestSpeed = 0.25;     // m/s
constexpr double kSure = 3.0;           // standard deviations of a speed that is one
constexpr double kLeastSpread = 0.12;   // m, of a reach when clusters are assigned
constexpr double kExpected = 1.1;       // factor of the outline within which returns are expected
constexpr int kFewestEnds = 3;          // directions with an end in view that tell of a body
constexpr double kRigid = 0.5;          // share of ends in view that move as those of one body
constexpr double kOverlap = 0.8;        // of the gate, the most that overlapping clusters cost
constexpr double kSameSpeed = 0.5;      // m/s, difference of two tracks of one body
constexpr double kNear = 1.2;           // factor of the outline within which its parts lie
constexpr double kAwaited = 0.35;       // s unseen for which its place counts as expected
constexpr double kLost = 0.3;           // s in full view of its place after which it is not listed
constexpr size_t kMostTracks = 64;

void Shape(Track* track) {
  const Points2 corners = track->body.Outline();
  if (corners.size() < 3) return;
  track->outline = SmallestEllipse(corners, 0.01, kThinnest);
  track->reach = 0.0;
  for (const auto& q : corners) track->reach = std::max(track->reach, q.norm());
}

}  // namespace

void Tracker::Predict(double t) {
  const double dt = std::clamp(t - t_, 0.0, 1.0);
  t_ = t;
  for (auto& track : tracks_) track.body.Predict(dt, config_.acceleration);
}

std::vector<Ellipse> Tracker::Expected() const {
  std::vector<Ellipse> outlines;
  for (const auto& track : tracks_)
    if (track.confirmed && t_ - track.seen < kAwaited)
      outlines.push_back(track.Outline().Scaled(kExpected));
  return outlines;
}

/// Parts of one mover that something in front of it separates belong together.
void Tracker::Join(std::vector<Cluster>* clusters) const {
  for (const auto& track : tracks_) {
    if (!track.confirmed) continue;
    const Ellipse outline = track.Outline().Scaled(kNear);
    Cluster* first = nullptr;
    for (auto& cluster : *clusters) {
      if (cluster.members.empty() || outline.Level(cluster.center.head<2>()) > 1.0) continue;
      if (!first) {
        first = &cluster;
        continue;
      }
      first->members.insert(first->members.end(), cluster.members.begin(), cluster.members.end());
      for (size_t k = 0; k < kDirections; ++k)
        if (cluster.reaches[k].along > first->reaches[k].along)
          first->reaches[k] = cluster.reaches[k];
      cluster.members.clear();
    }
  }
  clusters->erase(std::remove_if(clusters->begin(), clusters->end(),
                                 [](const Cluster& c) { return c.members.empty(); }),
                  clusters->end());
}

/// How unlikely they are to belong together (BodyFilter::Distance); infinite for what cannot. What
/// overlaps may always: its other ends may have come into view.
double Tracker::Cost(const Track& track, const Cluster& cluster) const {
  const Eigen::Vector2d c = cluster.center.head<2>();
  const double far = 2.0 * track.reach + config_.gate * kLeastSpread +
                     0.1 * config_.gate * std::sqrt(track.body.VelocityVariance());
  if ((c - track.body.p()).norm() > far) return INFINITY;
  const double cost = track.body.Distance(cluster.reaches, config_.measurement, kLeastSpread);
  const double overlap = track.Outline().Level(c);
  const double most = kOverlap * config_.gate * config_.gate;
  if (cost < 0.0) return std::min(1.0, overlap) * most;
  return track.confirmed && overlap < 1.0 ? std::min(cost, most) : cost;
}

void Tracker::Correct(const Cluster& cluster, Track* track) const {
  const Sight sight = track->body.Correct(cluster.reaches, config_.measurement, kUnseen);
  track->sought = t_;
  if (sight.ends < kFewestEnds) return Shape(track);  // may be anything that stands there
  track->rigid += 0.5 * (static_cast<double>(sight.rigid) / sight.ends - track->rigid);
  track->seen = t_;
  ++track->detections;
  ++track->row;
  track->z += 0.3 * (cluster.center.z() - track->z);
  Shape(track);
}

void Tracker::Confirm(Track* track) const {
  const double speed = track->body.v().norm();
  const double sigma = std::sqrt(track->body.VelocityVariance());
  if (speed > kRestSpeed) track->moved = t_;
  if (track->confirmed) return;
  track->trail.push_back(track->body.p());
  const double travel = (track->body.p() - track->birth).norm();
  track->confirmed = track->row >= config_.confirm_sweeps && track->rigid >= kRigid &&
                     speed >= std::max(config_.confirm_speed, kSure * sigma) &&
                     travel >= config_.confirm_distance;
  track->fresh = track->confirmed;
  track->known = t_;
}

void Tracker::Birth(Cluster* cluster) {
  if (tracks_.size() >= kMostTracks) return;
  Track track;
  track.id = next_id_;
  next_id_ = next_id_ == INT32_MAX ? 1 << 30 : next_id_ + 1;
  track.birth = cluster->center.head<2>();
  track.body = BodyFilter(track.birth, cluster->reaches, kFirstSpeed, kUnseen);
  track.z = cluster->center.z();
  track.born = track.seen = track.sought = track.moved = t_;
  track.detections = track.row = 1;
  track.trail.push_back(track.birth);
  Shape(&track);
  cluster->track = track.id;
  tracks_.push_back(std::move(track));
}

/// A stray part of a known mover is no other mover.
void Tracker::Absorb(Cluster* cluster) {
  for (auto& track : tracks_)
    if (track.confirmed && track.Outline().Scaled(kNear).Level(cluster->center.head<2>()) < 1.0)
      cluster->track = track.id;
}

/// Tracks that were not seen; those whose place something hides are still sought.
void Tracker::Seek(const Panorama& panorama) {
  for (auto& track : tracks_) {
    if (track.seen == t_) continue;
    track.row = 0;
    const Eigen::Vector2d c = track.Outline().center;
    Eigen::Vector2d across(panorama.origin().y() - c.y(), c.x() - panorama.origin().x());
    across *= 0.7 * track.reach / std::max(1e-6, across.norm());
    int hidden = 0;
    for (const double side : {-1.0, 0.0, 1.0}) hidden += panorama.Hides(c + side * across, -3);
    if (hidden >= 2) track.sought = t_;
  }
}

void Tracker::Update(const Panorama& panorama, std::vector<Cluster>* clusters) {
  Join(clusters);
  Eigen::MatrixXd cost(tracks_.size(), clusters->size());
  for (size_t i = 0; i < tracks_.size(); ++i)
    for (size_t j = 0; j < clusters->size(); ++j)
      cost(static_cast<int>(i), static_cast<int>(j)) = Cost(tracks_[i], (*clusters)[j]);
  const auto assigned = Assign(cost, config_.gate * config_.gate);
  for (size_t i = 0; i < tracks_.size(); ++i) {
    Track& track = tracks_[i];
    track.fresh = false;
    if (assigned[i] < 0) continue;
    Cluster& cluster = (*clusters)[static_cast<size_t>(assigned[i])];
    cluster.track = track.id;
    Correct(cluster, &track);
    Confirm(&track);
  }
  Seek(panorama);
  Unite();
  Bury();
  for (auto& cluster : *clusters) {
    if (cluster.track < 0) Absorb(&cluster);
    if (cluster.track < 0) Birth(&cluster);
  }
}

/// Of two tracks on one body the older one stays.
void Tracker::Unite() {
  const auto same = [](const Track& a, const Track& b) {
    const double sigma = std::sqrt(a.body.VelocityVariance() + b.body.VelocityVariance());
    return a.confirmed && a.Outline().Level(b.Outline().center) < 1.0 &&
           (a.body.v() - b.body.v()).norm() < std::max(kSameSpeed, kSure * sigma);
  };
  for (size_t i = 0; i < tracks_.size(); ++i)
    for (size_t j = tracks_.size() - 1; j > i; --j) {
      if (!same(tracks_[i], tracks_[j]) && !same(tracks_[j], tracks_[i])) continue;
      if (tracks_[j].seen > tracks_[i].seen) {  // the older id, the better place
        if (tracks_[i].confirmed && !tracks_[j].confirmed) continue;
        tracks_[j].id = tracks_[i].id;
        std::swap(tracks_[i], tracks_[j]);
      }
      tracks_.erase(tracks_.begin() + static_cast<long>(j));
    }
}

void Tracker::Bury() {
  const auto dead = [this](const Track& track) {
    const double gap = t_ - track.seen;
    if (!track.confirmed) return gap > kTentativeGap;
    if (track.outline.SemiAxes().x() > config_.max_size) return true;
    if (t_ - track.sought > config_.coast || gap > config_.coast_hidden) return true;
    return t_ - track.moved > config_.settle + gap;
  };
  tracks_.erase(std::remove_if(tracks_.begin(), tracks_.end(), dead), tracks_.end());
}

void Tracker::Forget(const Eigen::Vector2d& center, double radius) {
  tracks_.erase(
      std::remove_if(tracks_.begin(), tracks_.end(),
                     [&](const Track& track) { return (track.body.p() - center).norm() < radius; }),
      tracks_.end());
}

bool Tracker::Moves(int id) const {
  for (const auto& track : tracks_)
    if (track.id == id) return track.confirmed || t_ - track.born < kTentativeAge;
  return false;
}

std::vector<world::Obstacle> Tracker::Obstacles(double middle, double semi_height,
                                                double grow) const {
  const Eigen::Matrix3d level = Eigen::Vector3d(1.0, 1.0, 0.0).asDiagonal();
  std::vector<world::Obstacle> obstacles;
  for (const auto& track : tracks_) {
    if (!track.confirmed || t_ - track.seen > config_.coast_listed || t_ - track.sought > kLost)
      continue;
    const Ellipse outline = track.Outline();
    world::Obstacle o;
    o.id = track.id;
    o.moving = true;
    o.center.start = t_;
    o.center.duration = config_.horizon;
    o.center.coefficients.resize(2, 3);
    o.center.coefficients.row(0) << outline.center.transpose(), middle;
    o.center.coefficients.row(1) << config_.horizon * track.body.v().transpose(), 0.0;
    o.shape.setZero();
    o.shape.topLeftCorner<2, 2>() = outline.Scaled(grow).shape;
    o.shape(2, 2) = 1.0 / (semi_height * semi_height);
    o.position_covariance = track.body.CenterVariance() * level;
    o.velocity_covariance = track.body.VelocityVariance() * level;
    obstacles.push_back(o);
  }
  return obstacles;
}

}  // namespace chase::mapping
