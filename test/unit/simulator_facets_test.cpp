#include <embree3/rtcore.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "common/world/random.h"
#include "services/simulator/embree_calls.h"
#include "services/simulator/facet_tables.h"
#include "services/simulator/moving.h"

namespace chase::simulator {
namespace {

using Eigen::Vector3d;
using world::Solid;

constexpr float kEver = std::numeric_limits<float>::infinity();
constexpr int kTiles = 3000;

/// The same triangles under Embree and in tables.
class Both {
 public:
  Both(const world::GroundSpec& ground, const std::vector<Solid>& solids, int segments)
      : device_(rtcNewDevice("threads=1,isa=avx2")), scene_(rtcNewScene(device_)) {
    const Mesh mesh = GroundMesh(ground, {-30.0, -30.0}, {30.0, 30.0});
    Attach(device_, scene_, mesh);
    tables.SetGround(ground, mesh);
    for (const Solid& solid : solids) {
      const Mesh placed = Placed(SolidMesh(solid, segments), solid);
      Attach(device_, scene_, placed);
      tables.Add(solid, placed, segments, Material::kCrown);
    }
    tables.Finish();
    rtcCommitScene(scene_);
  }
  ~Both() {
    rtcReleaseScene(scene_);
    rtcReleaseDevice(device_);
  }
  Both(const Both&) = delete;
  Both& operator=(const Both&) = delete;

  RTCRayHit8 Embree(const RayPacket& rays) const {
    return Intersect(scene_, rays, kAllTheWay, RTC_INTERSECT_CONTEXT_FLAG_NONE).work;
  }

  FacetTables tables;

 private:
  RTCDevice device_;
  RTCScene scene_;
};

/// Four packets of neighbouring rays from a place in the middle towards anywhere.
void RandomTile(world::Random* random, RayPacket* rays) {
  const auto uniform = [&](double most) {
    return static_cast<float>(random->Uniform(-most, most));
  };
  const float o[3] = {uniform(6.0), uniform(6.0), 2.2f + uniform(1.5)};
  const float d[3] = {uniform(1.0), uniform(1.0), uniform(0.5)};
  const float across = uniform(0.02), up = uniform(0.02);
  for (int k = 0; k < 4; ++k)
    for (int i = 0; i < 8; ++i) {
      const auto lane = static_cast<float>(i), row = static_cast<float>(k);
      rays[k].ox[i] = o[0], rays[k].oy[i] = o[1], rays[k].oz[i] = o[2];
      rays[k].dx[i] = d[0] + across * lane, rays[k].dy[i] = d[1] - across * lane;
      rays[k].dz[i] = d[2] + up * row;
    }
}

/// Every hit that is settled has Embree's bits. Returns the share that is settled.
double ExpectTheBitsOfEmbree(const Both& both, uint64_t seed) {
  world::Random random(seed);
  long settled = 0;
  for (int tile = 0; tile < kTiles; ++tile) {
    RayPacket rays[4];
    HitPacket hits[4];
    unsigned unsure[4];
    RandomTile(&random, rays);
    TraceFacets(both.tables.world(), rays, 4, hits, unsure);
    for (int k = 0; k < 4; ++k) {
      const RTCRayHit8 embree = both.Embree(rays[k]);
      for (int i = 0; i < 8; ++i) {
        if (unsure[k] >> i & 1u) continue;
        ++settled;
        EXPECT_EQ(hits[k].distance[i], embree.ray.tfar[i]) << "seed " << seed << " tile " << tile;
        if (embree.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) {
          EXPECT_EQ(hits[k].material[i], Material::kNothing);
          continue;
        }
        EXPECT_EQ(hits[k].nx[i], embree.hit.Ng_x[i]) << "seed " << seed << " tile " << tile;
        EXPECT_EQ(hits[k].ny[i], embree.hit.Ng_y[i]);
        EXPECT_EQ(hits[k].nz[i], embree.hit.Ng_z[i]);
      }
    }
  }
  return static_cast<double>(settled) / (32.0 * kTiles);
}

/// Solids of one kind around the middle, turned each another way.
std::vector<Solid> Scattered(Solid::Kind kind, uint64_t seed) {
  world::Random random(seed);
  std::vector<Solid> solids;
  while (solids.size() < 150) {
    const Vector3d center(random.Uniform(-25.0, 25.0), random.Uniform(-25.0, 25.0),
                          random.Uniform(0.0, 4.0));
    if (center.head<2>().cwiseAbs().maxCoeff() < 9.0) continue;
    const double across = random.Uniform(0.1, 2.0);
    solids.push_back(
        {kind, center, {across, across, random.Uniform(0.3, 2.0)}, random.Uniform(-3.0, 3.0)});
  }
  return solids;
}

world::GroundSpec Rough() {
  world::GroundSpec ground;
  ground.roughness = 0.3;
  ground.slope = {0.05, -0.03};
  return ground;
}

#ifdef __x86_64__
constexpr bool kTraces = true;
constexpr double kSettled = 0.9994;  // what is left is at edges and outlines
#else
constexpr bool kTraces = false;
constexpr double kSettled = 0.0;
#endif

TEST(Facets, BoxesHaveTheBitsOfEmbree) {
  const Both both({}, Scattered(Solid::Kind::kBox, 1), 20);
  EXPECT_GE(ExpectTheBitsOfEmbree(both, 11), kSettled);
}

TEST(Facets, CylindersHaveTheBitsOfEmbree) {
  for (const int segments : {20, 48}) {
    const Both both({}, Scattered(Solid::Kind::kCylinder, 2), segments);
    EXPECT_GE(ExpectTheBitsOfEmbree(both, 12), kSettled);
  }
}

TEST(Facets, EllipsoidsHaveTheBitsOfEmbree) {
  for (const int segments : {20, 48}) {
    const Both both(Rough(), Scattered(Solid::Kind::kEllipsoid, 3), segments);
    EXPECT_GE(ExpectTheBitsOfEmbree(both, 13), kSettled);
  }
}

TEST(Facets, RoughGroundHasTheBitsOfEmbree) {
  const Both both(Rough(), {}, 20);
  EXPECT_GE(ExpectTheBitsOfEmbree(both, 14), kSettled);
}

TEST(Facets, InsideASolidNothingIsSettled) {
  const Both both({}, {{Solid::Kind::kEllipsoid, {0.0, 0.0, 2.0}, {9.0, 9.0, 5.0}, 0.0}}, 20);
  EXPECT_EQ(ExpectTheBitsOfEmbree(both, 15), 0.0);
}

/// An instance under Embree.
class Instance {
 public:
  Instance(RTCDevice device, const Solid& solid)
      : part_(rtcNewScene(device)),
        scene_(rtcNewScene(device)),
        geometry_(rtcNewGeometry(device, RTC_GEOMETRY_TYPE_INSTANCE)) {
    Attach(device, part_, SolidMesh(solid, 48));
    rtcCommitScene(part_);
    rtcSetGeometryInstancedScene(geometry_, part_);
    const auto c = static_cast<float>(std::cos(solid.yaw)),
               s = static_cast<float>(std::sin(solid.yaw));
    const Eigen::Vector3f p = solid.center.cast<float>();
    const float place[12] = {c, s, 0, -s, c, 0, 0, 0, 1, p.x(), p.y(), p.z()};
    rtcSetGeometryTransform(geometry_, 0, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, place);
    rtcCommitGeometry(geometry_);
    rtcAttachGeometry(scene_, geometry_);
    rtcCommitScene(scene_);
  }
  ~Instance() {
    rtcReleaseGeometry(geometry_);
    rtcReleaseScene(scene_);
    rtcReleaseScene(part_);
  }
  Instance(const Instance&) = delete;
  Instance& operator=(const Instance&) = delete;
  RTCScene scene() const { return scene_; }

 private:
  RTCScene part_, scene_;
  RTCGeometry geometry_;
};

/// What is behind the rays, some of it nearer than what moves.
HitPacket Behind(world::Random* random) {
  HitPacket hits;
  for (int i = 0; i < 8; ++i) {
    hits.distance[i] = i % 2 ? kEver : static_cast<float>(random->Uniform(0.1, 2.0));
    hits.nx[i] = 1.0f, hits.ny[i] = 2.0f, hits.nz[i] = 3.0f;
    hits.material[i] = Material::kGround;
  }
  return hits;
}

TEST(Facets, WhatMovesHasTheBitsOfEmbreesInstances) {
  world::Random random(17);
  const RTCDevice device = rtcNewDevice("threads=1,isa=avx2");
  long settled = 0, hit = 0;
  for (int tile = 0; tile < kTiles; ++tile) {
    RayPacket rays[4];
    RandomTile(&random, rays);
    const RayPacket& r = rays[0];
    const auto along = static_cast<float>(random.Uniform(1.5, 8.0));
    const Solid solid = {static_cast<Solid::Kind>(tile % 3),
                         {r.ox[3] + along * r.dx[3] + random.Uniform(-0.3, 0.3),
                          r.oy[3] + along * r.dy[3], r.oz[3] + along * r.dz[3]},
                         {random.Uniform(0.2, 0.8), random.Uniform(0.2, 0.8), 0.5},
                         random.Uniform(-3.0, 3.0)};
    Moving moving(device);
    moving.Add(solid, 48, Material::kMover);
    moving.Place({solid});
    const Instance instance(device, solid);
    const HitPacket behind = Behind(&random);
    HitPacket hits = behind;
    if (!moving.Settled(r, &hits)) continue;
    ++settled;
    const RTCRayHit8 embree =
        Intersect(instance.scene(), r, behind.distance, RTC_INTERSECT_CONTEXT_FLAG_COHERENT).work;
    for (int i = 0; i < 8; ++i) {
      EXPECT_EQ(hits.distance[i], embree.ray.tfar[i]) << "tile " << tile;
      const bool found = embree.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
      EXPECT_EQ(hits.material[i], found ? Material::kMover : Material::kGround);
      EXPECT_EQ(hits.nz[i], found ? embree.hit.Ng_z[i] : 3.0f);
      hit += found;
    }
  }
  rtcReleaseDevice(device);
  EXPECT_GT(settled, kTraces ? 0.97 * kTiles : -1.0);
  EXPECT_GT(hit, kTraces ? kTiles : -1);
}

TEST(Facets, WhatRaysMeetIsWithinTheBoxesAroundIt) {
  world::Random random(16);
  int culled = 0;
  for (int tile = 0; tile < kTiles; ++tile) {
    RayPacket rays[4];
    RandomTile(&random, rays);
    const float along = static_cast<float>(random.Uniform(100.0, 200.0));
    const int packet = tile % 4, lane = tile % 8;
    const RayPacket& r = rays[packet];
    BoundsNode box;
    box.count = 1;
    box.center[0][0] = r.ox[lane] + along * r.dx[lane];
    box.center[1][0] = r.oy[lane] + along * r.dy[lane];
    box.center[2][0] = r.oz[lane] + along * r.dz[lane];
    for (auto& half : box.half) half[0] = 1e-3f;
    EXPECT_TRUE(MayMeet(&box, 1, rays, 4));
    for (auto& center : box.center) center[0] = -center[0];  // behind, as it is far ahead
    culled += MayMeet(&box, 1, rays, 4) ? 0 : 1;
  }
  EXPECT_GT(culled, kTraces ? 0.95 * kTiles : -1.0);
}

}  // namespace
}  // namespace chase::simulator
