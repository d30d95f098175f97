#pragma once

#include "services/simulator/packets.h"

namespace chase::simulator {

/// A vertex in frame W, m.
struct alignas(16) FacetVertex {
  float p[4];  ///< x y z, and nothing
};

/// A solid of the world and where its vertices are.
struct FacetSolid {
  enum class Kind : int { kBox, kCylinder, kEllipsoid };
  Kind kind = Kind::kBox;
  Material material = Material::kNothing;
  int first = 0;           ///< of its vertices, in the order of SolidMesh()
  int around = 0;          ///< edges around
  int rows = 0;            ///< of quads from the lower to the upper pole or rim
  float center[3] = {};    ///< frame W, m
  float per_half[3] = {};  ///< 1 / half size, 1/m
  float cos_yaw = 1.0f, sin_yaw = 0.0f;
};

/// Eight boxes along the axes of frame W around solids or around further nodes, m.
struct BoundsNode {
  alignas(32) float center[3][8] = {}, half[3][8] = {};
  int child[8] = {};  ///< a node, or ~solid
  int count = 0;
};

/// The ground's grid of vertices; each cell's quad is cut from its first to its last corner.
struct GroundGrid {
  int columns = 0, rows = 0;   ///< of cells
  const float* x = nullptr;    ///< of the columns' vertices, m
  const float* y = nullptr;    ///< of the rows' vertices, m
  const float* z = nullptr;    ///< row by row, m
  const float* top = nullptr;  ///< of each cell's corners above the mean plane, m
  float cells_per_m[2] = {};
  float plane[3] = {};   ///< the mean plane's height: plane[0] + plane[1] x + plane[2] y
  float highest = 0.0f;  ///< above the mean plane, m
};

/// All that stands still; its arrays belong to whoever made it.
struct FacetWorld {
  const FacetVertex* vertices = nullptr;
  const FacetSolid* solids = nullptr;
  const BoundsNode* nodes = nullptr;  ///< the first is the root; none: no solids
  int node_count = 0;
  GroundGrid ground;  ///< no cells: there is none
};

/// A solid that rays may meet, and how far away it is at least, in multiples of their length.
struct NearSolid {
  int solid;
  float least;
};

/// Solids that rays may meet, the nearest first.
struct NearSolids {
  const NearSolid* first = nullptr;
  int count = 0;
};

/// First hits of n packets, at most kMostPackets, with the bits that Embree 3 gives for the same
/// triangles on AVX2. A ray's bit in unsure[packet] says that its hit is not settled: it passes too
/// near an edge or an outline, starts inside a solid, or the processor has no AVX2.
void TraceFacets(const FacetWorld& world, const RayPacket* rays, int n, HitPacket* hits,
                 unsigned* unsure);

/// The same where it is known which solids the rays may meet.
void TraceNear(const FacetWorld& world, const NearSolids& near, const RayPacket* rays, int n,
               HitPacket* hits, unsigned* unsure);

/// Where a solid that moves is: its axes are turned by a yaw around z.
struct FacetPlace {
  float cos_yaw = 1.0f, sin_yaw = 0.0f;
  float p[3] = {};  ///< frame W, m
};

/// Hits on n solids that move, the first of `shapes`, each in its own axes, in front of the hits
/// already found; with the bits of Embree's instances, normals turned into frame W. False, with
/// nothing changed, where a ray is not settled.
bool TraceMoving(const FacetWorld& shapes, const FacetPlace* places, int n, const RayPacket& rays,
                 HitPacket* hits);

/// False if none of the rays meets any of the boxes.
bool MayMeet(const BoundsNode* boxes, int n_nodes, const RayPacket* rays, int n);

}  // namespace chase::simulator
