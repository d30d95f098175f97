#include "services/simulator/lidar.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "services/simulator/streams.h"

namespace chase::simulator {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kPi = 3.14159265358979323846;
constexpr double kResolution = 0.002;  // m, of a range
constexpr int kTogether = 8;           // sequences traced at once
constexpr double kCutDeg = 180.0;      // azimuth at which a sweep begins
static_assert(kFirings % kFiringsPerPacket == 0, "a packet holds firings of one sweep");
static_assert(kRings <= kMostPackets && kRings % 8 == 0);

/// Reflectivity at normal incidence, 0 to 255.
float Reflectivity(Material material) {
  switch (material) {
    case Material::kNothing:
      return 0.0f;
    case Material::kGround:
      return 30.0f;
    case Material::kWall:
      return 80.0f;
    case Material::kBox:
      return 70.0f;
    case Material::kPillar:
      return 95.0f;
    case Material::kEllipsoid:
      return 70.0f;
    case Material::kTrunk:
      return 45.0f;
    case Material::kCrown:
      return 55.0f;
    case Material::kMover:
      return 120.0f;
    case Material::kCarrier:
      return 20.0f;
    case Material::kTarget:
    case Material::kDecoy:
      return 180.0f;
  }
  return 0.0f;
}

Sweep NewSweep(double start) {
  Sweep sweep;
  sweep.start = start;
  for (auto* values : {&sweep.x, &sweep.y, &sweep.z, &sweep.t}) values->reserve(kFirings * kRings);
  for (auto* values : {&sweep.intensity, &sweep.ring}) values->reserve(kFirings * kRings);
  return sweep;
}

/// Cosine between ray i and the normal where it hits.
float Incidence(const RayPacket& rays, const HitPacket& hits, int i) {
  const Vector3f normal(hits.nx[i], hits.ny[i], hits.nz[i]);
  const Vector3f d(rays.dx[i], rays.dy[i], rays.dz[i]);
  const float length = normal.norm();
  return length > 0.0f ? std::abs(normal.dot(d)) / length : 0.0f;
}

}  // namespace

std::string LidarConfig::Problem() const {
  if (!(rate >= 0.0 && rate <= 10.0)) return "rate is not within 0 to 10 Hz";
  if (packets && rate != 10.0 && rate != 0.0)
    return "rate is neither 0 nor 10 Hz, at which data packets come without gaps";
  if (!(noise >= 0.0)) return "noise is below 0 m";
  if (!(dropout >= 0.0 && dropout <= 1.0)) return "dropout is not within 0 to 1";
  if (!(min_range >= 0.0 && max_range > min_range)) return "max_range is not above min_range";
  return "";
}

double LaserDelay(int ring) {
  const int laser = ring < 8 ? 2 * ring : 2 * (ring - 8) + 1;
  return laser * kLaserPeriod;
}

Vector3d LaserDirection(int firing, int ring) {
  const double elevation = (2.0 * ring - 15.0) * kPi / 180.0;
  const double step = firing + LaserDelay(ring) / kFiringPeriod;
  const double turned = step * 2.0 * kPi / kFirings;
  return {-std::cos(elevation) * std::cos(turned), std::cos(elevation) * std::sin(turned),
          std::sin(elevation)};
}

TimedPose Interpolated(const TimedPose& a, const TimedPose& b, double t) {
  const double s = b.t > a.t ? (t - a.t) / (b.t - a.t) : 0.0;
  return {t, a.p + s * (b.p - a.p), a.q.slerp(s, b.q)};
}

Lidar::Lidar(const LidarConfig& config, const world::Rig& rig, uint64_t seed)
    : config_(config), p_BL_(rig.lidar_position), q_BL_(rig.R_BL()), random_(seed, kLidarStream) {
  for (int firing = 0; firing < kFirings; ++firing)
    for (int ring = 0; ring < kRings; ++ring)
      directions_.push_back(LaserDirection(firing, ring).cast<float>());
}

double Lidar::FiringTime(int firing) const {
  return static_cast<double>(sweep_index_) / config_.rate + firing * kFiringPeriod;
}

void Lidar::Advance(const std::vector<TimedPose>& poses, const Scene& scene) {
  if (config_.rate <= 0.0 || poses.size() < 2) return;
  while (FiringTime(firing_) < poses.back().t) {
    if (firing_ == 0) sweep_ = NewSweep(FiringTime(0));
    firing_ += FireNext(poses, scene);
    if (firing_ < kFirings) continue;
    complete_ = std::move(sweep_);
    firing_ = 0;
    ++sweep_index_;
  }
}

/// Up to eight sequences that are due, traced together: a packet for each ring, as a ring's rays
/// from firing to firing stay close.
int Lidar::FireNext(const std::vector<TimedPose>& poses, const Scene& scene) {
  RayPacket rays[kRings] = {};
  HitPacket hits[kRings];
  int count = 0;
  std::size_t i = 0;
  for (; count < kTogether && firing_ + count < kFirings; ++count) {
    const double t = FiringTime(firing_ + count);
    if (t >= poses.back().t) break;
    while (i + 2 < poses.size() && poses[i + 1].t <= t) ++i;
    Aim(Interpolated(poses[i], poses[i + 1], t), count, rays);
  }
  for (RayPacket& packet : rays) packet.count = count;
  scene.TraceAcross(rays, kRings, hits);
  for (int lane = 0; lane < count; ++lane) RecordFiring(firing_ + lane, rays, hits, lane);
  return count;
}

void Lidar::RecordFiring(int firing, const RayPacket* rays, const HitPacket* hits, int lane) {
  if (config_.packets) writer_.Begin(FiringTime(firing), kCutDeg + firing * 360.0 / kFirings);
  for (int ring = 0; ring < kRings; ++ring) Record(firing, ring, rays[ring], hits[ring], lane);
  if (config_.packets) writer_.End();
}

void Lidar::Aim(const TimedPose& body, int lane, RayPacket* rays) const {
  const Vector3f origin = (body.p + body.q * p_BL_).cast<float>();
  const Eigen::Matrix3f R_WL = (body.q * q_BL_).toRotationMatrix().cast<float>();
  const Vector3f* directions = &directions_[static_cast<std::size_t>((firing_ + lane) * kRings)];
  for (int ring = 0; ring < kRings; ++ring) {
    const Vector3f d = R_WL * directions[ring];
    const Vector3f o =
        config_.packets ? Vector3f(origin + LaserHeight(ring) * R_WL.col(2)) : origin;
    RayPacket& packet = rays[ring];
    packet.ox[lane] = o.x(), packet.oy[lane] = o.y(), packet.oz[lane] = o.z();
    packet.dx[lane] = d.x(), packet.dy[lane] = d.y(), packet.dz[lane] = d.z();
  }
}

/// Of a ray of the packet. One draw of noise and one of loss for every laser, hit or not, so that
/// what is seen does not shift the numbers of the lasers after it.
void Lidar::Record(int firing, int ring, const RayPacket& rays, const HitPacket& hits, int lane) {
  const float range = hits.distance[lane];
  const bool hit = range >= config_.min_range && range <= config_.max_range;
  double noise = 0.0;
  if (hit)
    noise = config_.noise * random_.Gaussian();
  else
    random_.SkipGaussian();
  if (random_.Uniform() < config_.dropout || !hit) return;
  const double measured = kResolution * std::round((range + noise) / kResolution);
  const Vector3f p =
      static_cast<float>(measured) * directions_[static_cast<std::size_t>(firing * kRings + ring)];
  sweep_.x.push_back(p.x());
  sweep_.y.push_back(p.y());
  sweep_.z.push_back(config_.packets ? p.z() + LaserHeight(ring) : p.z());
  sweep_.t.push_back(static_cast<float>(firing * kFiringPeriod + LaserDelay(ring)));
  const float intensity =
      Reflectivity(hits.material[lane]) * (0.3f + 0.7f * Incidence(rays, hits, lane));
  const auto reflectivity = static_cast<uint8_t>(std::clamp(intensity, 1.0f, 255.0f));
  if (config_.packets) writer_.Add(ring, measured, reflectivity);
  sweep_.intensity.push_back(reflectivity);
  sweep_.ring.push_back(static_cast<uint8_t>(ring));
}

std::optional<Sweep> Lidar::Take() { return std::exchange(complete_, std::nullopt); }

}  // namespace chase::simulator
