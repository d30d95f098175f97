#pragma once

#include <vector>

#include "services/simulator/facets.h"
#include "services/simulator/mesh.h"

namespace chase::simulator {

/// Owner of a FacetWorld's arrays.
class FacetTables {
 public:
  /// The mesh of `GroundMesh`, whose vertices stand row by row.
  void SetGround(const world::GroundSpec& ground, const Mesh& mesh);
  /// A solid's mesh as placed in the world.
  void Add(const world::Solid& solid, const Mesh& mesh, int segments, Material material);
  /// Once all is there.
  void Finish();
  const FacetWorld& world() const { return world_; }

 private:
  int Group(const int* begin, const int* end);

  struct Bounds {
    Eigen::Vector3f min, max;
  };
  std::vector<FacetVertex> vertices_;
  std::vector<FacetSolid> solids_;
  std::vector<Bounds> bounds_;  // of the solids
  std::vector<BoundsNode> nodes_;
  std::vector<float> x_, y_, z_, top_;
  FacetWorld world_;
};

}  // namespace chase::simulator
