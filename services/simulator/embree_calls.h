#pragma once

#include <embree3/rtcore.h>

#include "services/simulator/mesh.h"
#include "services/simulator/packets.h"

namespace chase::simulator {

/// Adds a mesh to a scene; the scene numbers its geometries from zero in this order.
void Attach(RTCDevice device, RTCScene scene, const Mesh& mesh);

/// What Embree made of a packet.
struct EmbreeHits {
  alignas(32) RTCRayHit8 work;
  alignas(32) int valid[8];  // -1: a ray that was traced
};

/// Traces a packet up to where its rays are known to end, in multiples of their length.
EmbreeHits Intersect(RTCScene scene, const RayPacket& rays, const float* reach,
                     RTCIntersectContextFlags flags);

/// Reach of rays that nothing is known to end.
extern const float kAllTheWay[8];

}  // namespace chase::simulator
