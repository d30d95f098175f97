#include "services/simulator/scene.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string>
#include <vector>

#include "services/simulator/embree_calls.h"
#include "services/simulator/moving.h"

namespace chase::simulator {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using world::Solid;

constexpr int kFine = 48, kCoarse = 20;  // edges around a solid
constexpr double kMargin = 110.0;        // m of ground beyond what stands on it
constexpr double kRoughMargin = 40.0;
constexpr double kAway = 1000.0;  // m below: out of range and under the ground

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

void CopyRay(const RayPacket& from, int i, RayPacket* to, int k) {
  to->ox[k] = from.ox[i], to->oy[k] = from.oy[i], to->oz[k] = from.oz[i];
  to->dx[k] = from.dx[i], to->dy[k] = from.dy[i], to->dz[k] = from.dz[i];
}

void CopyHit(const HitPacket& from, int i, HitPacket* to, int k) {
  to->distance[k] = from.distance[i], to->material[k] = from.material[i];
  to->nx[k] = from.nx[i], to->ny[k] = from.ny[i], to->nz[k] = from.nz[i];
}

}  // namespace

struct Scene::Impl {
  Impl(const world::Scenario& s, double lead, RTCDevice d)
      : scenario(s), actors(s), decoy_lead(lead), device(d), moving(d) {}
  ~Impl();

  void BuildStatic();
  void BuildMoving();
  void TraceFixed(const RayPacket& rays, HitPacket* hits) const;
  void Settle(const RayPacket& rays, bool unsure, HitPacket* hits) const;

  world::Scenario scenario;
  Actors actors;
  double decoy_lead;
  bool shows_target = true, shows_decoy = false;
  RTCDevice device;
  FacetTables facets;
  RTCScene fixed = nullptr;
  Moving moving;
  std::vector<Solid> standing_solids, moving_solids;
  // By number of the geometry plus one, as the invalid number plus one is zero.
  std::vector<Material> static_materials = {Material::kNothing};
  Vector3d target_center = Vector3d::Zero();
};

Scene::Impl::~Impl() {
  if (fixed) rtcReleaseScene(fixed);
  rtcReleaseDevice(device);
}

void Scene::Impl::BuildStatic() {
  standing_solids = world::StaticSolids(scenario);
  const auto& solids = standing_solids;
  fixed = rtcNewScene(device);
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

void Scene::Impl::BuildMoving() {
  const TargetState state = actors.Target(0.0);
  moving.Add(state.cylinder, kFine, Material::kTarget);
  if (state.has_carrier) moving.Add(state.carrier, kFine, Material::kCarrier);
  for (const auto& mover : actors.Movers(0.0)) moving.Add(mover.solid, kFine, Material::kMover);
  if (decoy_lead > 0.0) moving.Add(state.cylinder, kFine, Material::kDecoy);
}

/// What stands still, under Embree. The whole packet, as a ray that grazes an edge can get another
/// hit in other company.
void Scene::Impl::TraceFixed(const RayPacket& rays, HitPacket* hits) const {
  const EmbreeHits found = Intersect(fixed, rays, kAllTheWay, RTC_INTERSECT_CONTEXT_FLAG_COHERENT);
  const auto& hit = found.work.hit;
  for (int i = 0; i < 8; ++i) {
    if (!found.valid[i]) continue;
    hits->material[i] = static_materials[hit.geomID[i] + 1u];
    hits->distance[i] = found.work.ray.tfar[i];
    hits->nx[i] = hit.Ng_x[i], hits->ny[i] = hit.Ng_y[i], hits->nz[i] = hit.Ng_z[i];
  }
}

void Scene::Impl::Settle(const RayPacket& rays, bool unsure, HitPacket* hits) const {
  if (unsure) TraceFixed(rays, hits);
  if (rays.movers) moving.Trace(rays, hits);
}

Scene::Scene(const world::Scenario& scenario, double decoy_lead) {
  const RTCDevice device = rtcNewDevice("threads=1,isa=avx2");
  if (!device)
    throw std::runtime_error("simulator: Embree gives no device; a processor with AVX2 is needed");
  impl_ = std::make_unique<Impl>(scenario, decoy_lead, device);
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
  impl_->moving.Place(solids);
  impl_->target_center = target.center;
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
  unsigned unsure[kMostPackets], open[kMostPackets];
  TraceFacets(impl_->facets.world(), rays, n, hits, unsure);
  std::copy(unsure, unsure + n, open);
  const bool movers = impl_->moving.MayMeet(rays, n);
  HitPacket fixed[kMostPackets];
  if (movers) std::copy(hits, hits + n, fixed);
  for (int k = 0; k < n && movers; ++k)
    if (!impl_->moving.Settled(rays[k], &hits[k])) open[k] = ~0u;
  for (int lane = 0; lane < rays[0].count; ++lane)
    for (int first = 0; first < n; first += 8) {
      const auto any = [&](const unsigned* bits) {
        return std::any_of(bits + first, bits + first + 8,
                           [&](unsigned b) { return (b >> lane & 1u) != 0; });
      };
      if (!any(open)) continue;
      RayPacket across;
      HitPacket found;
      across.movers = movers;
      for (int i = 0; i < 8; ++i) {
        CopyRay(rays[first + i], lane, &across, i);
        CopyHit((movers ? fixed : hits)[first + i], lane, &found, i);
      }
      impl_->Settle(across, any(unsure), &found);
      for (int i = 0; i < 8; ++i) CopyHit(found, i, &hits[first + i], lane);
    }
}

void Scene::TraceTargetAlone(const RayPacket& rays, bool* hits) const {
  impl_->moving.TraceFirst(impl_->target_center, rays, hits);
}

}  // namespace chase::simulator
