#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "services/simulator/actors.h"
#include "services/simulator/facets.h"
#include "services/simulator/packets.h"

namespace chase::simulator {

/// The world as triangles under Embree: everything static in one structure, and in another an
/// instance for each thing that moves.
class Scene {
 public:
  /// `decoy_lead`: how far a decoy is ahead of the target on its path, s; 0: there is none.
  explicit Scene(const world::Scenario& scenario, double decoy_lead = 0.0);
  ~Scene();

  /// Moves the target and the movers to mission time t [s].
  void MoveTo(double t);
  /// From the next MoveTo() on: are the target and its carrier there, is the decoy? At first only
  /// the target is.
  void Show(bool target, bool decoy);
  /// All that moves, where it stands now.
  const std::vector<world::Solid>& MovingSolids() const;
  /// All that stands but the ground.
  const std::vector<world::Solid>& StandingSolids() const;
  void Trace(const RayPacket& rays, HitPacket* hits) const { Trace(&rays, 1, hits); }
  /// Traces n packets, at most kMostPackets.
  void Trace(const RayPacket* rays, int n, HitPacket* hits) const;
  /// The same where it is known which of StandingSolids() the rays may meet.
  void Trace(const NearSolids& near, const RayPacket* rays, int n, HitPacket* hits) const;
  /// The same, n a multiple of eight; what Embree settles travels in packets across the tile, of a
  /// lane of eight packets each.
  void TraceAcross(const RayPacket* rays, int n, HitPacket* hits) const;
  /// True per ray that hits the target's cylinder where nothing else stands in the world.
  void TraceTargetAlone(const RayPacket& rays, bool* hits) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace chase::simulator
