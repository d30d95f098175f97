#include "services/simulator/facet_tables.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace chase::simulator {
namespace {

using Eigen::Vector3f;

constexpr float kMargin = 1e-3f;  // m, of the boxes around the solids

FacetSolid::Kind KindOf(world::Solid::Kind kind) {
  if (kind == world::Solid::Kind::kBox) return FacetSolid::Kind::kBox;
  return kind == world::Solid::Kind::kCylinder ? FacetSolid::Kind::kCylinder
                                               : FacetSolid::Kind::kEllipsoid;
}

}  // namespace

void FacetTables::Add(const world::Solid& solid, const Mesh& mesh, int segments,
                      Material material) {
  FacetSolid row;
  row.kind = KindOf(solid.kind);
  row.material = material;
  row.first = static_cast<int>(vertices_.size());
  row.around = segments;
  row.rows = segments / 2;
  for (int i = 0; i < 3; ++i) {
    row.center[i] = static_cast<float>(solid.center[i]);
    row.per_half[i] = static_cast<float>(1.0 / solid.half_size[i]);
  }
  row.cos_yaw = static_cast<float>(std::cos(solid.yaw));
  row.sin_yaw = static_cast<float>(std::sin(solid.yaw));
  solids_.push_back(row);
  Bounds bounds = {mesh.vertices[0], mesh.vertices[0]};
  for (const Vector3f& v : mesh.vertices) {
    bounds = {bounds.min.cwiseMin(v), bounds.max.cwiseMax(v)};
    vertices_.push_back({{v.x(), v.y(), v.z(), 0.0f}});
  }
  bounds_.push_back(bounds);
}

/// Heights are taken above the slope that the world's ground has, so that little lies between the
/// lowest and the highest.
void FacetTables::SetGround(const world::GroundSpec& ground, const Mesh& mesh) {
  const float y0 = mesh.vertices[0].y();
  while (x_.size() < mesh.vertices.size() && mesh.vertices[x_.size()].y() == y0)
    x_.push_back(mesh.vertices[x_.size()].x());
  for (std::size_t i = 0; i < mesh.vertices.size(); i += x_.size())
    y_.push_back(mesh.vertices[i].y());
  std::vector<float> above;
  const Eigen::Vector2f slope = ground.slope.cast<float>();
  for (const Vector3f& v : mesh.vertices) {
    z_.push_back(v.z());
    above.push_back(v.z() - (static_cast<float>(ground.height) + slope.dot(v.head<2>())));
  }
  const std::size_t columns = x_.size(), rows = y_.size();
  for (std::size_t j = 0; j + 1 < rows; ++j)
    for (std::size_t i = 0; i + 1 < columns; ++i) {
      const float* low = &above[j * columns + i];
      const float* high = low + columns;
      top_.push_back(std::max({low[0], low[1], high[0], high[1]}));
    }
  GroundGrid& grid = world_.ground;
  grid.columns = static_cast<int>(columns) - 1, grid.rows = static_cast<int>(rows) - 1;
  grid.cells_per_m[0] = static_cast<float>(grid.columns) / (x_.back() - x_.front());
  grid.cells_per_m[1] = static_cast<float>(grid.rows) / (y_.back() - y_.front());
  grid.plane[0] = static_cast<float>(ground.height);
  grid.plane[1] = slope.x(), grid.plane[2] = slope.y();
  grid.highest = *std::max_element(top_.begin(), top_.end()) + kMargin;
}

/// Halved three times by the longest side, until eight groups are left.
int FacetTables::Group(const int* begin, const int* end) {
  std::vector<std::vector<int>> parts = {{begin, end}};
  const auto middle = [&](int i, int axis) {
    const Bounds& b = bounds_[static_cast<std::size_t>(i)];
    return b.min[axis] + b.max[axis];
  };
  while (parts.size() < 8 && parts[0].size() > 1) {
    std::vector<std::vector<int>> halves;
    for (auto& part : parts) {
      Vector3f min = Vector3f::Constant(INFINITY), max = -min;
      for (const int i : part)
        for (int k = 0; k < 3; ++k)
          min[k] = std::min(min[k], middle(i, k)), max[k] = std::max(max[k], middle(i, k));
      int axis = 0;
      (max - min).maxCoeff(&axis);
      std::stable_sort(part.begin(), part.end(),
                       [&](int a, int b) { return middle(a, axis) < middle(b, axis); });
      const auto half = part.begin() + static_cast<std::ptrdiff_t>((part.size() + 1) / 2);
      halves.emplace_back(part.begin(), half);
      if (half != part.end()) halves.emplace_back(half, part.end());
    }
    parts = std::move(halves);
  }
  const std::size_t at = nodes_.size();
  nodes_.emplace_back();
  BoundsNode node;
  for (const auto& part : parts) {
    Bounds box = bounds_[static_cast<std::size_t>(part[0])];
    for (const int i : part) {
      const Bounds& b = bounds_[static_cast<std::size_t>(i)];
      box = {box.min.cwiseMin(b.min), box.max.cwiseMax(b.max)};
    }
    const int slot = node.count++;
    for (int k = 0; k < 3; ++k) {
      node.center[k][slot] = 0.5f * (box.min[k] + box.max[k]);
      node.half[k][slot] = 0.5f * (box.max[k] - box.min[k]) + kMargin;
    }
    node.child[slot] = part.size() == 1 ? ~part[0] : Group(part.data(), part.data() + part.size());
  }
  nodes_[at] = node;
  return static_cast<int>(at);
}

void FacetTables::Finish() {
  std::vector<int> all(solids_.size());
  std::iota(all.begin(), all.end(), 0);
  if (!all.empty()) Group(all.data(), all.data() + all.size());
  world_.vertices = vertices_.data();
  world_.solids = solids_.data();
  world_.nodes = nodes_.data();
  world_.node_count = static_cast<int>(nodes_.size());
  world_.ground.x = x_.data(), world_.ground.y = y_.data(), world_.ground.z = z_.data();
  world_.ground.top = top_.data();
}

}  // namespace chase::simulator
