#include "services/simulator/embree_calls.h"

#include <cstring>
#include <limits>

namespace chase::simulator {
namespace {

constexpr float kEver = std::numeric_limits<float>::infinity();

void Fill(const RayPacket& rays, const float* reach, EmbreeHits* out) {
  RTCRay8& ray = out->work.ray;
  std::memcpy(ray.org_x, rays.ox, sizeof rays.ox);
  std::memcpy(ray.org_y, rays.oy, sizeof rays.oy);
  std::memcpy(ray.org_z, rays.oz, sizeof rays.oz);
  std::memcpy(ray.dir_x, rays.dx, sizeof rays.dx);
  std::memcpy(ray.dir_y, rays.dy, sizeof rays.dy);
  std::memcpy(ray.dir_z, rays.dz, sizeof rays.dz);
  for (int i = 0; i < 8; ++i) {
    ray.tnear[i] = ray.time[i] = 0.0f;
    out->valid[i] = i < rays.count ? -1 : 0;
    ray.tfar[i] = out->valid[i] ? reach[i] : -1.0f;
    ray.mask[i] = ~0u;
    ray.id[i] = static_cast<unsigned>(i);
    ray.flags[i] = 0;
    out->work.hit.geomID[i] = out->work.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
}

}  // namespace

const float kAllTheWay[8] = {kEver, kEver, kEver, kEver, kEver, kEver, kEver, kEver};

void Attach(RTCDevice device, RTCScene scene, const Mesh& mesh) {
  RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
  void* vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                           3 * sizeof(float), mesh.vertices.size());
  std::memcpy(vertices, mesh.vertices.front().data(), mesh.vertices.size() * 3 * sizeof(float));
  void* indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                          3 * sizeof(uint32_t), mesh.triangles.size());
  std::memcpy(indices, mesh.triangles.data(), mesh.triangles.size() * 3 * sizeof(uint32_t));
  rtcCommitGeometry(geometry);
  rtcAttachGeometry(scene, geometry);
  rtcReleaseGeometry(geometry);
}

EmbreeHits Intersect(RTCScene scene, const RayPacket& rays, const float* reach,
                     RTCIntersectContextFlags flags) {
  EmbreeHits hits;
  Fill(rays, reach, &hits);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = flags;
  rtcIntersect8(hits.valid, scene, &context, &hits.work);
  return hits;
}

}  // namespace chase::simulator
