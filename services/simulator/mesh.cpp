#include "services/simulator/mesh.h"

#include <algorithm>
#include <cmath>

namespace chase::simulator {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr double kPi = 3.14159265358979323846;
constexpr double kGroundStep = 0.5;  // m

uint32_t Index(std::size_t i) { return static_cast<uint32_t>(i); }

/// Rows of `columns` vertices joined by quads; a closed row joins its last vertex to its first.
void AddQuads(int rows, int columns, bool closed, Mesh* mesh) {
  const int across = closed ? columns : columns - 1;
  for (int r = 0; r + 1 < rows; ++r)
    for (int c = 0; c < across; ++c) {
      const int next = (c + 1) % columns;
      const uint32_t a = Index(r * columns + c), b = Index(r * columns + next);
      const uint32_t d = Index((r + 1) * columns + c), e = Index((r + 1) * columns + next);
      mesh->triangles.push_back({a, b, e});
      mesh->triangles.push_back({a, e, d});
    }
}

Mesh BoxMesh(const Vector3d& half) {
  Mesh mesh;
  for (int i = 0; i < 8; ++i) {
    const Vector3d corner(i & 1 ? half.x() : -half.x(), i & 2 ? half.y() : -half.y(),
                          i & 4 ? half.z() : -half.z());
    mesh.vertices.push_back(corner.cast<float>());
  }
  mesh.triangles = {{0, 2, 3}, {0, 3, 1}, {4, 5, 7}, {4, 7, 6}, {0, 1, 5}, {0, 5, 4},
                    {2, 6, 7}, {2, 7, 3}, {0, 4, 6}, {0, 6, 2}, {1, 3, 7}, {1, 7, 5}};
  return mesh;
}

/// A row of vertices around z, from x towards y.
void AddRing(double rx, double ry, double z, int segments, Mesh* mesh) {
  for (int i = 0; i < segments; ++i) {
    const double angle = 2.0 * kPi * i / segments;
    mesh->vertices.push_back(Vector3d(rx * std::cos(angle), ry * std::sin(angle), z).cast<float>());
  }
}

Mesh CylinderMesh(const Vector3d& half, int segments) {
  Mesh mesh;
  for (const double z : {-half.z(), half.z()}) AddRing(half.x(), half.y(), z, segments, &mesh);
  AddQuads(2, segments, true, &mesh);
  const uint32_t bottom = Index(mesh.vertices.size()), top = bottom + 1;
  mesh.vertices.push_back(Vector3d(0.0, 0.0, -half.z()).cast<float>());
  mesh.vertices.push_back(Vector3d(0.0, 0.0, half.z()).cast<float>());
  const uint32_t n = Index(segments);
  for (uint32_t i = 0; i < n; ++i) {
    mesh.triangles.push_back({bottom, (i + 1) % n, i});
    mesh.triangles.push_back({top, n + i, n + (i + 1) % n});
  }
  return mesh;
}

Mesh EllipsoidMesh(const Vector3d& half, int segments) {
  Mesh mesh;
  const int rows = segments / 2 + 1;
  for (int r = 0; r < rows; ++r) {
    const double latitude = kPi * (static_cast<double>(r) / (rows - 1) - 0.5);
    const double c = std::max(0.0, std::cos(latitude));
    AddRing(half.x() * c, half.y() * c, half.z() * std::sin(latitude), segments, &mesh);
  }
  AddQuads(rows, segments, true, &mesh);
  return mesh;
}

}  // namespace

Mesh SolidMesh(const world::Solid& solid, int segments) {
  switch (solid.kind) {
    case world::Solid::Kind::kBox:
      return BoxMesh(solid.half_size);
    case world::Solid::Kind::kCylinder:
      return CylinderMesh(solid.half_size, segments);
    case world::Solid::Kind::kEllipsoid:
      return EllipsoidMesh(solid.half_size, segments);
  }
  return {};
}

Mesh Placed(Mesh mesh, const world::Solid& solid) {
  const double c = std::cos(solid.yaw), s = std::sin(solid.yaw);
  for (auto& vertex : mesh.vertices) {
    const Vector3d p = vertex.cast<double>();
    const Vector3d turned(c * p.x() - s * p.y(), s * p.x() + c * p.y(), p.z());
    vertex = (solid.center + turned).cast<float>();
  }
  return mesh;
}

Mesh GroundMesh(const world::GroundSpec& ground, const Vector2d& min, const Vector2d& max) {
  const Vector2d size = max - min;
  const auto cells = [&](double length) {
    return ground.roughness > 0.0 ? static_cast<int>(std::ceil(length / kGroundStep)) : 1;
  };
  const int nx = cells(size.x()), ny = cells(size.y());
  Mesh mesh;
  for (int j = 0; j <= ny; ++j)
    for (int i = 0; i <= nx; ++i) {
      const double x = min.x() + size.x() * i / nx, y = min.y() + size.y() * j / ny;
      mesh.vertices.push_back(Vector3d(x, y, world::GroundHeight(ground, x, y)).cast<float>());
    }
  AddQuads(ny + 1, nx + 1, false, &mesh);
  return mesh;
}

}  // namespace chase::simulator
