#include <embree3/rtcore.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "common/world/random.h"
#include "services/simulator/facet_tables.h"

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
    Attach(mesh);
    tables.SetGround(ground, mesh);
    for (const Solid& solid : solids) {
      const Mesh placed = Placed(SolidMesh(solid, segments), solid);
      Attach(placed);
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
    alignas(32) RTCRayHit8 work = {};
    alignas(32) int valid[8];
    std::memcpy(work.ray.org_x, rays.ox, 3 * sizeof rays.ox);
    std::memcpy(work.ray.dir_x, rays.dx, 3 * sizeof rays.dx);
    for (int i = 0; i < 8; ++i) {
      valid[i] = -1;
      work.ray.tfar[i] = kEver;
      work.ray.mask[i] = ~0u;
      work.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    }
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    rtcIntersect8(valid, scene_, &context, &work);
    return work;
  }

  FacetTables tables;

 private:
  void Attach(const Mesh& mesh) {
    RTCGeometry geometry = rtcNewGeometry(device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    std::memcpy(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                        3 * sizeof(float), mesh.vertices.size()),
                mesh.vertices.data(), mesh.vertices.size() * 3 * sizeof(float));
    std::memcpy(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                        3 * sizeof(uint32_t), mesh.triangles.size()),
                mesh.triangles.data(), mesh.triangles.size() * 3 * sizeof(uint32_t));
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene_, geometry);
    rtcReleaseGeometry(geometry);
  }

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
