#pragma once

#include <Eigen/Core>
#include <memory>

#include "services/simulator/actors.h"

namespace chase::simulator {

enum class Material : int {
  kNothing,
  kGround,
  kWall,
  kBox,
  kPillar,
  kEllipsoid,
  kTrunk,
  kCrown,
  kMover,
  kCarrier,
  kTarget
};

/// Eight rays in frame W; a ray beyond `count` is not traced.
struct RayPacket {
  alignas(32) float ox[8], oy[8], oz[8];  ///< origins, m
  alignas(32) float dx[8], dy[8], dz[8];  ///< directions, any length
  int count = 8;
};

/// As many packets may travel together.
inline constexpr int kMostPackets = 4;

/// First hits; distances in multiples of the direction's length.
struct HitPacket {
  alignas(32) float distance[8];          ///< infinity: nothing
  alignas(32) float nx[8], ny[8], nz[8];  ///< normal, frame W, not normalised
  Material material[8];
};

/// The world as triangles under Embree: everything static in one structure, and in another an
/// instance for each thing that moves.
class Scene {
 public:
  explicit Scene(const world::Scenario& scenario);
  ~Scene();

  /// Moves the target and the movers to mission time t [s].
  void MoveTo(double t);
  void Trace(const RayPacket& rays, HitPacket* hits) const { Trace(&rays, 1, hits); }
  /// Traces n packets, at most kMostPackets.
  void Trace(const RayPacket* rays, int n, HitPacket* hits) const;
  /// True per ray that hits the target's cylinder where nothing else stands in the world.
  void TraceTargetAlone(const RayPacket& rays, bool* hits) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace chase::simulator
