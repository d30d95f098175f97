#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "common/world/scenario.h"

namespace chase::simulator {

/// Triangles with outward normals, counter-clockwise seen from outside. m.
struct Mesh {
  std::vector<Eigen::Vector3f> vertices;
  std::vector<std::array<uint32_t, 3>> triangles;
};

/// The solid's surface in its own axes, its centre at the origin. `segments` is the number of edges
/// around; the surface lies within half_size * (1 - cos(pi / segments)) inside the true one.
Mesh SolidMesh(const world::Solid& solid, int segments);

/// The mesh turned by the solid's yaw and moved to its centre: frame W.
Mesh Placed(Mesh mesh, const world::Solid& solid);

/// The ground over the rectangle min to max: two triangles where it is even, a grid where it is
/// not.
Mesh GroundMesh(const world::GroundSpec& ground, const Eigen::Vector2d& min,
                const Eigen::Vector2d& max);

}  // namespace chase::simulator
