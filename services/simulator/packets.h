#pragma once

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
  kTarget,
  kDecoy
};

/// Eight rays in frame W; a ray beyond `count` is not traced.
struct RayPacket {
  alignas(32) float ox[8], oy[8], oz[8];  ///< origins, m
  alignas(32) float dx[8], dy[8], dz[8];  ///< directions, any length
  int count = 8;
  bool movers = true;  ///< false: what moves is not traced, as no ray meets any of it
};

/// As many packets may travel together.
inline constexpr int kMostPackets = 16;

/// First hits; distances in multiples of the direction's length.
struct HitPacket {
  alignas(32) float distance[8];          ///< infinity: nothing
  alignas(32) float nx[8], ny[8], nz[8];  ///< normal, frame W, not normalised
  Material material[8];
};

}  // namespace chase::simulator
