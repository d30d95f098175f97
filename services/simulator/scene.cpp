#include "services/simulator/scene.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "services/simulator/facet_tables.h"
#include "services/simulator/mesh.h"

namespace chase::simulator {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Solid;

constexpr std::size_t kTargetInstance = 0;
constexpr int kFine = 48, kCoarse = 20;  // edges around a solid
constexpr double kMargin = 110.0;        // m of ground beyond what stands on it
constexpr double kRoughMargin = 40.0;
constexpr float kAround = 1e-3f;  // m around what moves
constexpr double kAway = 1000.0;  // m below: out of range and under the ground

struct Instance {
  RTCGeometry geometry;
  Material material;
  float cos_yaw = 1.0f, sin_yaw = 0.0f;
};

void Attach(RTCDevice device, RTCScene scene, const Mesh& mesh) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           3 * sizeof(float), mesh.vertices.size());
  std::memcpy(vertices, mesh.vertices.data(), mesh.vertices.size() * 3 * sizeof(float));
  void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                          3 * sizeof(uint32_t), mesh.triangles.size());
  std::memcpy(indices, mesh.triangles.data(), mesh.triangles.size() * 3 * sizeof(uint32_t));
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
}

/// Material of the i-th of StaticSolids(), which lists the world's parts in their order.
Material StaticMaterial(const world::WorldSpec& world, std::size_t i, const Solid& solid) {
  std::size_t end = world.walls.size();
  if (i < end) return Material::kWall;
  if (i < (end += world.boxes.size())) return Material::kBox;
  if (i < (end += world.cylinders.size())) return Material::kPillar;
  if (i < (end += world.ellipsoids.size())) return Material::kEllipsoid;
  return solid.kind == Solid::Kind::kCylinder ? Material::kTrunk : Material::kCrown;
}

struct Rectangle {
  Vector2d min, max;
  void Add(const Vector2d& p, double margin) {
    min = min.cwiseMin((p.array() - margin).matrix());
    max = max.cwiseMax((p.array() + margin).matrix());
  }
};

Rectangle GroundExtent(const world::Scenario& scenario, const std::vector<Solid>& solids) {
  const double margin = scenario.world.ground.roughness > 0.0 ? kRoughMargin : kMargin;
  const Vector2d start = scenario.chaser.start.head<2>();
  Rectangle extent{start, start};
  extent.Add(start, margin);
  for (const auto& solid : solids) extent.Add(solid.center.head<2>(), margin);
  for (const auto& p : scenario.target.waypoints) extent.Add(p, margin);
  return extent;
}

/// Column-major 3x4: turn by the yaw, then to the centre.
void SetPlace(const Solid& solid, Instance* instance) {
  const float c = instance->cos_yaw = static_cast<float>(std::cos(solid.yaw));
  const float s = instance->sin_yaw = static_cast<float>(std::sin(solid.yaw));
  const Eigen::Vector3f p = solid.center.cast<float>();
  const float place[12] = {c, s, 0, -s, c, 0, 0, 0, 1, p.x(), p.y(), p.z()};
  rtcSetGeometryTransform(instance->geometry, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, place);
  rtcCommitGeometry(instance->geometry);
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

/// Rays up to where they are known to end.
void Fill(const RayPacket& rays, const float* reach, int* valid, RTCRayHit8* out) {
  std::memcpy(out->ray.org_x, rays.ox, sizeof rays.ox);
  std::memcpy(out->ray.org_y, rays.oy, sizeof rays.oy);
  std::memcpy(out->ray.org_z, rays.oz, sizeof rays.oz);
  std::memcpy(out->ray.dir_x, rays.dx, sizeof rays.dx);
  std::memcpy(out->ray.dir_y, rays.dy, sizeof rays.dy);
  std::memcpy(out->ray.dir_z, rays.dz, sizeof rays.dz);
  for (int i = 0; i < 8; ++i) {
    out->ray.tnear[i] = out->ray.time[i] = 0.0f;
    valid[i] = i < rays.count ? -1 : 0;
    out->ray.tfar[i] = valid[i] ? reach[i] : -1.0f;
    out->ray.mask[i] = ~0u;
    out->ray.id[i] = static_cast<unsigned>(i);
    out->ray.flags[i] = 0;
    out->hit.geomID[i] = out->hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
}

void CopyRay(const RayPacket& from, int i, RayPacket* to, int k) {
  to->ox[k] = from.ox[i], to->oy[k] = from.oy[i], to->oz[k] = from.oz[i];
  to->dx[k] = from.dx[i], to->dy[k] = from.dy[i], to->dz[k] = from.dz[i];
}

void CopyHit(const HitPacket& from, int i, HitPacket* to, int k) {
  to->distance[k] = from.distance[i], to->material[k] = from.material[i];
  to->nx[k] = from.nx[i], to->ny[k] = from.ny[i], to->nz[k] = from.nz[i];
}

/// Into the axes of what is turned by an angle with this cosine and sine.
void TurnBack(const Eigen::Vector2f& turn, float* x, float* y) {
  const Eigen::Vector2f v(*x, *y);
  *x = turn.x() * v.x() + turn.y() * v.y();
  *y = turn.x() * v.y() - turn.y() * v.x();
}

}  // namespace

struct Scene::Impl {
  Impl(const world::Scenario& s, double lead) : scenario(s), actors(s), decoy_lead(lead) {}
  ~Impl();

  RTCScene NewScene() { return parts.emplace_back(rtcNewScene(device)); }
  void BuildStatic();
  void BuildMoving();
  void AddInstance(RTCScene part, Material material);
  RTCScene MovingPart(const Solid& solid);
  void TraceFixed(const RayPacket& rays, HitPacket* hits) const;
  void TraceMoving(const RayPacket& rays, HitPacket* hits) const;
  void Settle(const RayPacket& rays, bool unsure, HitPacket* hits) const;

  world::Scenario scenario;
  Actors actors;
  double decoy_lead;
  bool shows_target = true, shows_decoy = false;
  RTCDevice device = nullptr;
  FacetTables facets;
  RTCScene fixed = nullptr, moving = nullptr, target = nullptr;
  std::vector<RTCScene> parts;
  std::vector<Instance> instances;
  std::vector<Solid> standing_solids, moving_solids;
  std::vector<BoundsNode> moving_boxes;
  // By number of the geometry plus one, as the invalid number plus one is zero.
  std::vector<Material> static_materials = {Material::kNothing};
  Vector3d target_center = Vector3d::Zero();
};

Scene::Impl::~Impl() {
  for (auto& instance : instances) rtcReleaseGeometry(instance.geometry);
  for (auto part : parts) rtcReleaseScene(part);
  if (device) rtcReleaseDevice(device);
}

void Scene::Impl::AddInstance(RTCScene part, Material material) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE);
  rtcSetGeometryInstancedScene(geometry, part);
  instances.push_back({geometry, material});
  rtcAttachGeometry(moving, geometry);
}

void Scene::Impl::BuildStatic() {
  standing_solids = world::StaticSolids(scenario);
  const auto& solids = standing_solids;
  fixed = NewScene();
  const Rectangle extent = GroundExtent(scenario, solids);
  const Mesh ground = GroundMesh(scenario.world.ground, extent.min, extent.max);
  Attach(device, fixed, ground);
  facets.SetGround(scenario.world.ground, ground);
  static_materials.push_back(Material::kGround);
  for (std::size_t i = 0; i < solids.size(); ++i) {
    const Material material = StaticMaterial(scenario.world, i, solids[i]);
    const bool tree = material == Material::kCrown || material == Material::kTrunk;
    const int segments = tree ? kCoarse : kFine;
    const Mesh mesh = Placed(SolidMesh(solids[i], segments), solids[i]);
    Attach(device, fixed, mesh);
    facets.Add(solids[i], mesh, segments, material);
    static_materials.push_back(material);
  }
  facets.Finish();
  rtcCommitScene(fixed);
}

RTCScene Scene::Impl::MovingPart(const Solid& solid) {
  const RTCScene part = NewScene();
  Attach(device, part, SolidMesh(solid, kFine));
  rtcCommitScene(part);
  return part;
}

void Scene::Impl::BuildMoving() {
  moving = NewScene();
  rtcSetSceneFlags(moving, RTC_SCENE_FLAG_DYNAMIC);
  rtcSetSceneBuildQuality(moving, RTC_BUILD_QUALITY_LOW);
  const TargetState state = actors.Target(0.0);
  target = MovingPart(state.cylinder);
  AddInstance(target, Material::kTarget);
  if (state.has_carrier) AddInstance(MovingPart(state.carrier), Material::kCarrier);
  for (const auto& mover : actors.Movers(0.0))
    AddInstance(MovingPart(mover.solid), Material::kMover);
  if (decoy_lead > 0.0) AddInstance(target, Material::kDecoy);
}

/// What stands still, under Embree. The whole packet, as a ray that grazes an edge can get another
/// hit in other company.
void Scene::Impl::TraceFixed(const RayPacket& rays, HitPacket* hits) const {
  constexpr float kEver = std::numeric_limits<float>::infinity();
  const float reach[8] = {kEver, kEver, kEver, kEver, kEver, kEver, kEver, kEver};
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  alignas(32) int valid[8];
  alignas(32) RTCRayHit8 work;
  Fill(rays, reach, valid, &work);
  rtcIntersect8(valid, fixed, &context, &work);
  for (int i = 0; i < 8; ++i) {
    if (!valid[i]) continue;
    const bool hit = work.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
    hits->material[i] = static_materials[work.hit.geomID[i] + 1u];
    hits->distance[i] = hit ? work.ray.tfar[i] : kEver;
    hits->nx[i] = work.hit.Ng_x[i], hits->ny[i] = work.hit.Ng_y[i], hits->nz[i] = work.hit.Ng_z[i];
  }
}

/// What moves, in front of the hits already found. Its normals are in the instance's axes.
void Scene::Impl::TraceMoving(const RayPacket& rays, HitPacket* hits) const {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  alignas(32) int valid[8];
  alignas(32) RTCRayHit8 work;
  Fill(rays, hits->distance, valid, &work);
  rtcIntersect8(valid, moving, &context, &work);
  for (int i = 0; i < 8; ++i) {
    if (!valid[i] || work.hit.instID[0][i] == RTC_INVALID_GEOMETRY_ID) continue;
    const Instance& instance = instances[work.hit.instID[0][i]];
    const float c = instance.cos_yaw, s = instance.sin_yaw;
    hits->material[i] = instance.material;
    hits->distance[i] = work.ray.tfar[i];
    hits->nx[i] = c * work.hit.Ng_x[i] - s * work.hit.Ng_y[i];
    hits->ny[i] = s * work.hit.Ng_x[i] + c * work.hit.Ng_y[i];
    hits->nz[i] = work.hit.Ng_z[i];
  }
}

void Scene::Impl::Settle(const RayPacket& rays, bool unsure, HitPacket* hits) const {
  if (unsure) TraceFixed(rays, hits);
  if (rays.movers) TraceMoving(rays, hits);
}

Scene::Scene(const world::Scenario& scenario, double decoy_lead)
    : impl_(std::make_unique<Impl>(scenario, decoy_lead)) {
  impl_->device = rtcNewDevice("threads=1,isa=avx2");
  if (!impl_->device)
    throw std::runtime_error("simulator: Embree gives no device; a processor with AVX2 is needed");
  impl_->BuildStatic();
  impl_->BuildMoving();
  MoveTo(0.0);
}

Scene::~Scene() = default;

void Scene::Show(bool target, bool decoy) {
  impl_->shows_target = target;
  impl_->shows_decoy = decoy;
}

void Scene::MoveTo(double t) {
  std::vector<Solid>& solids = impl_->moving_solids;
  solids.clear();
  const TargetState target = impl_->actors.Target(t);
  solids.push_back(target.cylinder);
  if (target.has_carrier) solids.push_back(target.carrier);
  if (!impl_->shows_target)
    for (Solid& solid : solids) solid.center.z() -= kAway;
  for (const auto& mover : impl_->actors.Movers(t)) solids.push_back(mover.solid);
  if (impl_->decoy_lead > 0.0) {
    solids.push_back(impl_->actors.Target(t + impl_->decoy_lead).cylinder);
    if (!impl_->shows_decoy) solids.back().center.z() -= kAway;
  }
  for (std::size_t i = 0; i < solids.size(); ++i) SetPlace(solids[i], &impl_->instances[i]);
  impl_->target_center = target.center;
  impl_->moving_boxes = BoxesAround(solids);
  rtcCommitScene(impl_->moving);
}

const std::vector<Solid>& Scene::MovingSolids() const { return impl_->moving_solids; }
const std::vector<Solid>& Scene::StandingSolids() const { return impl_->standing_solids; }

/// By the solids' own shapes; Embree settles what is unsure, packet by packet, as its streams
/// settle ties on the triangles' edges in another order.
void Scene::Trace(const RayPacket* rays, int n, HitPacket* hits) const {
  unsigned unsure[kMostPackets];
  TraceFacets(impl_->facets.world(), rays, n, hits, unsure);
  for (int k = 0; k < n; ++k) impl_->Settle(rays[k], unsure[k] != 0, &hits[k]);
}

void Scene::Trace(const NearSolids& near, const RayPacket* rays, int n, HitPacket* hits) const {
  unsigned unsure[kMostPackets];
  TraceNear(impl_->facets.world(), near, rays, n, hits, unsure);
  for (int k = 0; k < n; ++k) impl_->Settle(rays[k], unsure[k] != 0, &hits[k]);
}

void Scene::TraceAcross(const RayPacket* rays, int n, HitPacket* hits) const {
  unsigned unsure[kMostPackets];
  TraceFacets(impl_->facets.world(), rays, n, hits, unsure);
  const auto& boxes = impl_->moving_boxes;
  const bool movers = MayMeet(boxes.data(), static_cast<int>(boxes.size()), rays, n);
  for (int lane = 0; lane < rays[0].count; ++lane)
    for (int first = 0; first < n; first += 8) {
      bool open = false;
      for (int i = 0; i < 8; ++i) open = open || (unsure[first + i] >> lane & 1u) != 0;
      if (!open && !movers) continue;
      RayPacket across;
      HitPacket found;
      across.movers = movers;
      for (int i = 0; i < 8; ++i) {
        CopyRay(rays[first + i], lane, &across, i);
        CopyHit(hits[first + i], lane, &found, i);
      }
      impl_->Settle(across, open, &found);
      for (int i = 0; i < 8; ++i) CopyHit(found, i, &hits[first + i], lane);
    }
}

void Scene::TraceTargetAlone(const RayPacket& rays, bool* hits) const {
  alignas(32) int valid[8];
  alignas(32) RTCRayHit8 work;
  constexpr float kEver = std::numeric_limits<float>::infinity();
  const float reach[8] = {kEver, kEver, kEver, kEver, kEver, kEver, kEver, kEver};
  Fill(rays, reach, valid, &work);
  const Eigen::Vector3f center = impl_->target_center.cast<float>();
  const Instance& target = impl_->instances[kTargetInstance];
  const Eigen::Vector2f turn(target.cos_yaw, target.sin_yaw);
  for (int i = 0; i < 8; ++i) {
    work.ray.org_x[i] -= center.x();
    work.ray.org_y[i] -= center.y();
    work.ray.org_z[i] -= center.z();
    TurnBack(turn, &work.ray.org_x[i], &work.ray.org_y[i]);
    TurnBack(turn, &work.ray.dir_x[i], &work.ray.dir_y[i]);
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect8(valid, impl_->target, &context, &work);
  for (int i = 0; i < 8; ++i) hits[i] = valid[i] && work.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
}

}  // namespace chase::simulator
