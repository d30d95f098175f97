#pragma once

#include <embree3/rtcore.h>

#include <vector>

#include "services/simulator/facet_tables.h"

namespace chase::simulator {

/// What moves: an instance under Embree for each solid, and the same triangles as facets, by which
/// most rays are settled.
class Moving {
 public:
  explicit Moving(RTCDevice device);
  ~Moving();
  Moving(const Moving&) = delete;
  Moving& operator=(const Moving&) = delete;

  /// Before the first Place().
  void Add(const world::Solid& solid, int segments, Material material);
  /// All that was added, in its order, at new places.
  void Place(const std::vector<world::Solid>& solids);

  /// True if a ray may meet any of it.
  bool MayMeet(const RayPacket* rays, int n) const;
  /// By the facets, in front of the hits already found; false, with nothing changed, where a ray is
  /// not settled.
  bool Settled(const RayPacket& rays, HitPacket* hits) const;
  /// By the facets or by Embree.
  void Trace(const RayPacket& rays, HitPacket* hits) const;
  /// True per ray that would hit the solid that was added first, if it stood at a place, frame W,
  /// turned as it is, and nothing else were there.
  void TraceFirst(const Eigen::Vector3d& place, const RayPacket& rays, bool* hits) const;

 private:
  void PlaceInstances() const;

  RTCDevice device_;
  RTCScene scene_;
  std::vector<RTCScene> parts_;  // of the instances
  std::vector<RTCGeometry> instances_;
  std::vector<Material> materials_;
  FacetTables facets_;  // each solid in its own axes
  std::vector<FacetPlace> places_;
  std::vector<BoundsNode> boxes_;
  mutable bool instances_placed_ = false;  // Embree has them at their places
};

}  // namespace chase::simulator
