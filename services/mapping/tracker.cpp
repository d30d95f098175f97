#include "services/mapping/tracker.h"

#include <algorithm>
#include <cmath>

#include "common/track/association.h"
#include "common/world/forecast.h"

namespace chase::mapping {

namespace {

constexpr double kThinnest = 0.1;    // m, half width of a mover at least
constexpr double kFirstSpeed = 2.5;  // m/s, standard deviation of an unknown velocity
constexpr double kUnseen = 0.5;      // m, standard deviation of an end out of sight
constexpr double kReach = 0.125;     // m, the same where returns are divided: four are in the gate
constexpr double kPlace = 0.25;      // m, of a place where they are: two are within four of these
constexpr double kTentativeAge = 0.8;  // s after which an unconfirmed track does not count
constexpr double kRestSpeed = 0.25;    // m/s
constexpr double kHandOver = 0.3;      // s, from then on, until the static map holds it for sure
constexpr double kSure = 2.5;          // standard deviations of a speed that is one
constexpr double kLeastSpread = 0.12;  // m, of a reach when clusters are assigned
constexpr int kFewestEnds = 3;         // directions with an end in view that tell of a body
constexpr double kRigid = 0.5;         // share of ends in view that move as those of one body
constexpr double kSameSpeed = 0.5;     // m/s, difference of two tracks of one body
constexpr double kDetected = 0.9;      // probability of a detection of what is in full view
constexpr double kGlimpse = 1e-3;      // of what seems hidden: small, but with odds
constexpr double kClutter = 0.005;  // 1/m^2 new clusters a sweep: five in the 18 m around the drone
constexpr double kOwn = 20.0;       // likelihood ratio of what lies within a track's outline
constexpr double kVague = 0.2;      // of returns there that show too few ends of a body
constexpr double kBorn = 0.5;       // existence of a new track
constexpr double kListed = 0.5;     // from which a track is listed
constexpr double kDead = 0.25;      // below which a track ends
constexpr double kLeast = 0.2;      // probability of an assignment
constexpr size_t kMostTracks = 64;

/// Of a detection.
double Odds(double existence, double detection) {
  return existence * detection / (1.0 - existence * detection);
}

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
  for (auto& track : tracks_) {
    track.body.Predict(dt, {config_.acceleration, config_.change_rate, config_.change_speed});
    track.existence = track::Survival(track.existence, dt, config_.lifetime);
  }
}

std::vector<Footprint> Tracker::Expected() const {
  std::vector<Footprint> bodies;
  for (const auto& track : tracks_) {
    if (!track.confirmed) continue;
    if (track.body.PlaceVariance() > kPlace * kPlace) continue;
    Footprint body = track.body.Expected(config_.measurement, kReach);
    body.track = track.id;
    body.stood = track.stood;
    bodies.push_back(body);
  }
  return bodies;
}

/// How much likelier the cluster is if it is this track's. The ends in view tell of the two
/// coordinates of a place (BodyFilter::Distance, twice the mean over the ends). What overlaps may
/// always be the track's: its other ends may have come into view.
double Tracker::Ratio(const Track& track, const Cluster& cluster) const {
  const Eigen::Vector2d c = cluster.center.head<2>();
  const double far = 2.0 * track.reach + config_.gate * kLeastSpread +
                     0.1 * config_.gate * std::sqrt(track.body.VelocityVariance());
  const bool own = cluster.track == track.id;
  if (!own && (c - track.body.p()).norm() > far) return 0.0;
  const double inside = track.confirmed && track.Outline().Level(c) < 1.0 ? kOwn : 0.0;
  const double cost = track.body.Distance(cluster.reaches, config_.measurement, kLeastSpread);
  if (cost < 0.0) return own || inside > 0.0 ? kVague : 0.0;
  const double density = std::exp(-cost) / (2.0 * M_PI * kLeastSpread * kLeastSpread);
  const double ratio = cost < config_.gate * config_.gate ? density / kClutter : 0.0;
  return std::max(ratio, own ? kOwn : inside);
}

/// Probability of a detection, from what is in view of the place and its likely width. What stands
/// where the body should be hides nothing of it: its front is nearer.
double Tracker::Detection(const Track& track, const Panorama& panorama) const {
  const Ellipse outline = track.Outline();
  Eigen::Vector2d view = panorama.origin() - outline.center;
  view /= std::max(1e-6, view.norm());
  const Eigen::Vector2d across(view.y(), -view.x());
  const double depth = std::sqrt(view.dot(outline.shape.inverse() * view));
  const double aside = std::max(0.5 * track.reach, std::sqrt(track.body.CenterVariance(across)));
  double seen = 0.0;
  for (const double side : {-1.0, 0.0, 1.0}) {
    const Eigen::Vector2d q = outline.center + side * aside * across;
    seen += panorama.Sees({q.x(), q.y(), track.z}, depth) / 3.0;
  }
  return kDetected * seen * seen;
}

void Tracker::Correct(const Cluster& cluster, Track* track) const {
  const Sight sight = track->body.Correct(cluster.reaches, config_.measurement, kUnseen);
  if (sight.ends < kFewestEnds) return Shape(track);  // may be anything that stands there
  track->rigid += 0.5 * (static_cast<double>(sight.rigid) / sight.ends - track->rigid);
  track->seen = t_;
  ++track->detections;
  ++track->row;
  track->z += 0.3 * (cluster.center.z() - track->z);
  track->half_height += 0.3 * (cluster.half_height - track->half_height);
  Shape(track);
}

void Tracker::Confirm(Track* track) const {
  const double speed = track->body.v().norm();
  const double sigma = std::sqrt(track->body.VelocityVariance());
  if (speed <= kRestSpeed) {
    ++track->stood;
    track->rest = track->body.p();
  } else {
    track->moved = t_;
    // Its outline no longer overlaps that of the place where it stood.
    if ((track->body.p() - track->rest).norm() > 2.0 * track->reach) track->stood = 0;
  }
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
  track.half_height = cluster->half_height;
  track.born = track.seen = track.moved = t_;
  track.existence = kBorn;
  track.detections = track.row = 1;
  track.trail.push_back(track.birth);
  Shape(&track);
  cluster->track = track.id;
  tracks_.push_back(std::move(track));
}

void Tracker::Update(const Panorama& panorama, std::vector<Cluster>* clusters) {
  std::vector<track::Prior> priors;
  Eigen::MatrixXd ratio(tracks_.size(), clusters->size());
  for (size_t i = 0; i < tracks_.size(); ++i) {
    const double r = tracks_[i].existence;
    const double detection = std::max(kGlimpse, Detection(tracks_[i], panorama));
    priors.push_back({r, detection});
    for (size_t j = 0; j < clusters->size(); ++j) {
      auto& entry = ratio(static_cast<int>(i), static_cast<int>(j));
      entry = Ratio(tracks_[i], (*clusters)[j]);
      // What is seen could be seen, whatever else seems to hide the place. Where it is another's
      // that tells nothing of this track.
      if (entry > 1.0) entry *= Odds(r, kDetected) / Odds(r, detection);
    }
  }
  const auto association = track::Associate(priors, ratio);
  const auto assigned = track::Assign(association, kLeast);
  for (size_t i = 0; i < tracks_.size(); ++i) {
    Track& track = tracks_[i];
    track.existence = association.existence[static_cast<int>(i)];
    track.fresh = false;
    if (assigned[i] >= 0) {
      Cluster& cluster = (*clusters)[static_cast<size_t>(assigned[i])];
      cluster.track = track.id;
      Correct(cluster, &track);
      Confirm(&track);
    }
    if (track.seen != t_) track.row = 0;
  }
  Unite();
  Bury();
  for (auto& cluster : *clusters)
    if (cluster.track < 0) Birth(&cluster);
}

/// Of two tracks on one body the older one stays. Two that were both seen as movers are two; one
/// that was born after the other was last seen may be that one, found again.
void Tracker::Unite() {
  const auto same = [](const Track& a, const Track& b) {
    const bool again = a.seen < b.born;
    if (!a.confirmed || (b.confirmed && !again)) return false;
    const double sigma = std::sqrt(a.body.VelocityVariance() + b.body.VelocityVariance());
    if ((a.body.v() - b.body.v()).norm() > std::max(kSameSpeed, kSure * sigma)) return false;
    const double far = kSure * std::sqrt(a.body.CenterVariance() + b.body.CenterVariance());
    const Eigen::Vector2d place = b.Outline().center;
    return a.Outline().Level(place) < 1.0 || (again && (place - a.Outline().center).norm() < far);
  };
  for (size_t i = 0; i < tracks_.size(); ++i)
    for (size_t j = tracks_.size() - 1; j > i; --j) {
      if (!same(tracks_[i], tracks_[j]) && !same(tracks_[j], tracks_[i])) continue;
      const bool known = tracks_[i].confirmed && !tracks_[j].confirmed;
      if (!known && tracks_[j].seen > tracks_[i].seen) {  // the older id, the better place
        tracks_[j].id = tracks_[i].id;
        std::swap(tracks_[i], tracks_[j]);
      }
      tracks_.erase(tracks_.begin() + static_cast<long>(j));
    }
}

void Tracker::Bury() {
  const auto dead = [this](const Track& track) {
    return track.existence < kDead ||
           (track.confirmed && track.outline.SemiAxes().x() > config_.max_size);
  };
  tracks_.erase(std::remove_if(tracks_.begin(), tracks_.end(), dead), tracks_.end());
}

void Tracker::Forget(const Eigen::Vector2d& center, double radius, double around) {
  const auto within = [&](const Track& track) {
    return (track.body.p() - center).norm() < (track.confirmed ? radius : around);
  };
  tracks_.erase(std::remove_if(tracks_.begin(), tracks_.end(), within), tracks_.end());
}

const Track* Tracker::Find(int id) const {
  for (const auto& track : tracks_)
    if (track.id == id) return &track;
  return nullptr;
}

bool Tracker::Moves(int id) const {
  const Track* track = Find(id);
  return track && (track->confirmed ? !Rests(*track) : t_ - track->born < kTentativeAge);
}

std::vector<const Track*> Tracker::Unconfirmed() const {
  std::vector<const Track*> unconfirmed;
  for (const auto& track : tracks_)
    if (!track.confirmed && track.existence >= kListed &&
        t_ - track.born < kTentativeAge + kHandOver)
      unconfirmed.push_back(&track);
  return unconfirmed;
}

std::vector<world::Obstacle> Tracker::Obstacles(double middle, double semi_height,
                                                double grow) const {
  constexpr double to_come = world::kMoverNoise / 3.0 * world::kNoiseListed;
  const Eigen::Matrix3d level = Eigen::Vector3d(1.0, 1.0, 0.0).asDiagonal();
  std::vector<world::Obstacle> obstacles;
  for (const auto& track : tracks_) {
    if (!track.confirmed || track.existence < kListed) continue;
    if (track.seen - track.moved > config_.settle + kHandOver) continue;
    const Ellipse outline = track.Outline();
    world::Obstacle o;
    o.id = track.id;
    o.moving = true;
    o.existence = track.existence;
    o.center.start = t_;
    o.center.duration = config_.horizon;
    o.center.coefficients.resize(2, 3);
    o.center.coefficients.row(0) << outline.center.transpose(), middle;
    o.center.coefficients.row(1) << config_.horizon * track.body.v().transpose(), 0.0;
    o.shape.setZero();
    o.shape.topLeftCorner<2, 2>() = outline.Scaled(grow).shape;
    o.shape(2, 2) = 1.0 / (semi_height * semi_height);
    o.position_covariance = track.body.CenterVariance() * level;
    o.velocity_covariance = (track.body.VelocityVariance() + to_come) * level;
    obstacles.push_back(o);
  }
  return obstacles;
}

}  // namespace chase::mapping
