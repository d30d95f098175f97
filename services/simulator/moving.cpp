#include "services/simulator/moving.h"

#include <cmath>

#include "services/simulator/embree_calls.h"

namespace chase::simulator {
namespace {

using Eigen::Vector3d;
using world::Solid;

constexpr float kAround = 1e-3f;  // m around what moves

FacetPlace PlaceOf(const Solid& solid) {
  const Eigen::Vector3f p = solid.center.cast<float>();
  return {static_cast<float>(std::cos(solid.yaw)),
          static_cast<float>(std::sin(solid.yaw)),
          {p.x(), p.y(), p.z()}};
}

/// Column-major 3x4: turn by the yaw, then to the centre.
void SetPlace(const FacetPlace& at, RTCGeometry instance) {
  const float c = at.cos_yaw, s = at.sin_yaw;
  const float place[12] = {c, s, 0, -s, c, 0, 0, 0, 1, at.p[0], at.p[1], at.p[2]};
  rtcSetGeometryTransform(instance, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, place);
  rtcCommitGeometry(instance);
}

/// Boxes around solids, by eights.
std::vector<BoundsNode> BoxesAround(const std::vector<Solid>& solids) {
  std::vector<BoundsNode> nodes((solids.size() + 7) / 8);
  for (std::size_t i = 0; i < solids.size(); ++i) {
    const Solid& solid = solids[i];
    const double c = std::abs(std::cos(solid.yaw)), s = std::abs(std::sin(solid.yaw));
    const Vector3d& h = solid.half_size;
    const Vector3d half(c * h.x() + s * h.y(), s * h.x() + c * h.y(), h.z());
    BoundsNode& node = nodes[i / 8];
    const int slot = node.count++;
    for (int k = 0; k < 3; ++k) {
      node.center[k][slot] = static_cast<float>(solid.center[k]);
      node.half[k][slot] = static_cast<float>(half[k]) + kAround;
    }
  }
  return nodes;
}

/// Into the axes of what is turned so.
void TurnBack(const FacetPlace& place, float* x, float* y) {
  const float c = place.cos_yaw, s = place.sin_yaw, east = *x, north = *y;
  *x = c * east + s * north;
  *y = c * north - s * east;
}

}  // namespace

Moving::Moving(RTCDevice device) : device_(device), scene_(rtcNewScene(device)) {
  rtcSetSceneFlags(scene_, RTC_SCENE_FLAG_DYNAMIC);
  rtcSetSceneBuildQuality(scene_, RTC_BUILD_QUALITY_LOW);
}

Moving::~Moving() {
  for (auto instance : instances_) rtcReleaseGeometry(instance);
  for (auto part : parts_) rtcReleaseScene(part);
  rtcReleaseScene(scene_);
}

void Moving::Add(const Solid& solid, int segments, Material material) {
  const Mesh mesh = SolidMesh(solid, segments);
  const RTCScene part = parts_.emplace_back(rtcNewScene(device_));
  Attach(device_, part, mesh);
  rtcCommitScene(part);
  const RTCGeometry instance =
      instances_.emplace_back(rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_INSTANCE));
  rtcSetGeometryInstancedScene(instance, part);
  rtcAttachGeometry(scene_, instance);
  materials_.push_back(material);
  facets_.Add({solid.kind, Vector3d::Zero(), solid.half_size, 0.0}, mesh, segments, material);
}

void Moving::Place(const std::vector<Solid>& solids) {
  if (places_.empty()) facets_.Finish();
  places_.clear();
  for (const Solid& solid : solids) places_.push_back(PlaceOf(solid));
  boxes_ = BoxesAround(solids);
  instances_placed_ = false;
}

/// When a ray first asks for it; mostly none does.
void Moving::PlaceInstances() const {
  if (instances_placed_) return;
  for (std::size_t i = 0; i < places_.size(); ++i) SetPlace(places_[i], instances_[i]);
  rtcCommitScene(scene_);
  instances_placed_ = true;
}

bool Moving::MayMeet(const RayPacket* rays, int n) const {
  return simulator::MayMeet(boxes_.data(), static_cast<int>(boxes_.size()), rays, n);
}

bool Moving::Settled(const RayPacket& rays, HitPacket* hits) const {
  return TraceMoving(facets_.world(), places_.data(), static_cast<int>(places_.size()), rays, hits);
}

/// Embree's normals are in the instance's axes.
void Moving::Trace(const RayPacket& rays, HitPacket* hits) const {
  if (Settled(rays, hits)) return;
  PlaceInstances();
  const EmbreeHits found =
      Intersect(scene_, rays, hits->distance, RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
  const auto& hit = found.work.hit;
  for (int i = 0; i < 8; ++i) {
    const unsigned instance = hit.instID[0][i];
    if (!found.valid[i] || instance == RTC_INVALID_GEOMETRY_ID) continue;
    const float c = places_[instance].cos_yaw, s = places_[instance].sin_yaw;
    hits->material[i] = materials_[instance];
    hits->distance[i] = found.work.ray.tfar[i];
    hits->nx[i] = c * hit.Ng_x[i] - s * hit.Ng_y[i];
    hits->ny[i] = s * hit.Ng_x[i] + c * hit.Ng_y[i];
    hits->nz[i] = hit.Ng_z[i];
  }
}

void Moving::TraceFirst(const Vector3d& place, const RayPacket& rays, bool* hits) const {
  const Eigen::Vector3f center = place.cast<float>();
  RayPacket local = rays;
  for (int i = 0; i < 8; ++i) {
    local.ox[i] -= center.x(), local.oy[i] -= center.y(), local.oz[i] -= center.z();
    TurnBack(places_.front(), &local.ox[i], &local.oy[i]);
    TurnBack(places_.front(), &local.dx[i], &local.dy[i]);
  }
  HitPacket near;
  unsigned unsure = 0;
  const NearSolid first = {0, 0.0f};
  TraceNear(facets_.world(), {&first, 1}, &local, 1, &near, &unsure);
  for (int i = 0; i < 8; ++i) hits[i] = i < rays.count && std::isfinite(near.distance[i]);
  if (unsure == 0) return;
  const EmbreeHits found =
      Intersect(parts_.front(), local, kAllTheWay, RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT);
  for (int i = 0; i < 8; ++i)
    hits[i] = found.valid[i] && found.work.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
}

}  // namespace chase::simulator
