#include "services/mapping/ground.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "services/mapping/voxel_grid.h"

namespace chase::mapping {

namespace {

constexpr double kNear = 12.0;    // m, tiles that the plane looks at
constexpr double kLayer = 0.12;   // m, of noise about the ground
constexpr int kReach = 4;         // tiles, how far neighbours stand in
constexpr double kFollow = 0.25;  // share of a sweep's news that a tile takes over
constexpr double kUphill = 0.5;   // share of the step that a tile may stand out upward
constexpr size_t kFewest = 8;     // tiles that make a plane
constexpr int kTrimmings = 6;
// Slopes are none to this deviation where few tiles tell them, against that of a tile's height, m.
constexpr double kSlope = 0.3, kTile = 0.05;

}  // namespace

GroundModel::GroundModel(const GroundConfig& config)
    : config_(config), tiles_(static_cast<size_t>(kSide) * kSide) {}

size_t GroundModel::IndexOf(int x, int y) {
  return static_cast<size_t>((x & (kSide - 1)) * kSide + (y & (kSide - 1)));
}

int GroundModel::TileOf(double x) { return Floor(std::clamp(x, -1e8, 1e8)); }

GroundModel::Tile& GroundModel::Place(int x, int y) {
  Tile& tile = tiles_[IndexOf(x, y)];
  if (tile.x != x || tile.y != y) {
    tile = Tile();
    tile.x = x;
    tile.y = y;
  }
  return tile;
}

GroundModel::Tile& GroundModel::At(int x, int y) {
  Tile& tile = Place(x, y);
  if (tile.cached == sweep_) return tile;
  tile.cached = sweep_;
  tile.surroundings = Surroundings(tile);
  tile.estimate = tile.known ? tile.z : tile.surroundings;
  return tile;
}

const GroundModel::Tile* GroundModel::Seen(int x, int y) const {
  const Tile& tile = tiles_[IndexOf(x, y)];
  return tile.x == x && tile.y == y && tile.known ? &tile : nullptr;
}

std::optional<double> GroundModel::Known(int x, int y) const {
  const Tile* tile = Seen(x, y);
  return tile ? std::optional(tile->z) : std::nullopt;
}

/// Mean over the plane of the known tiles around one, without itself: of the nearest two rings,
/// else of the next.
double GroundModel::Surroundings(const Tile& tile) const {
  double sum = 0.0;
  int n = 0;
  for (int ring = 1; ring <= kReach && (ring <= 2 || n == 0); ++ring) {
    for (int dx = -ring; dx <= ring; ++dx) {
      const int stride = std::abs(dx) == ring ? 1 : 2 * ring;
      for (int dy = -ring; dy <= ring; dy += stride) {
        const Tile* seen = Seen(tile.x + dx, tile.y + dy);
        if (!seen) continue;
        sum += seen->z - plane_.Height(seen->x + 0.5, seen->y + 0.5);
        ++n;
      }
    }
  }
  return plane_.Height(tile.x + 0.5, tile.y + 0.5) + (n > 0 ? sum / n : 0.0);
}

/// The plane through the lowest returns of the tiles near the sensor, less those that stand out of
/// it upward: least squares, again and again.
void GroundModel::FollowPlane(const Eigen::Vector3d& origin) {
  std::vector<Eigen::Vector3d> low;
  for (const Tile* tile : seen_)
    if ((tile->low - origin).head<2>().norm() < kNear) low.push_back(tile->low);
  if (low.size() < kFewest) return;
  Plane plane;
  for (int i = 0; i < kTrimmings; ++i) {
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    A.diagonal().head<2>().setConstant(kTile * kTile / (kSlope * kSlope));
    for (const auto& p : low) {
      const Eigen::Vector3d row(p.x() - origin.x(), p.y() - origin.y(), 1.0);
      if (i > 0 && p.z() > plane.Height(p.x(), p.y()) + kUphill * config_.step) continue;
      A += row * row.transpose();
      b += p.z() * row;
    }
    if (A(2, 2) < static_cast<double>(kFewest)) return;
    const Eigen::Vector3d solution = A.ldlt().solve(b);
    plane.slope = solution.head<2>();
    plane.z0 = solution.z() - plane.slope.dot(origin.head<2>());
  }
  const double share = started_ ? kFollow : 1.0;
  const double here = plane_.Height(origin.x(), origin.y());
  const double z = here + share * (plane.Height(origin.x(), origin.y()) - here);
  plane_.slope += share * (plane.slope - plane_.slope);
  plane_.z0 = z - plane_.slope.dot(origin.head<2>());
  started_ = true;
}

void GroundModel::Update(const std::vector<Eigen::Vector3f>& points,
                         const Eigen::Vector3d& origin) {
  ++sweep_;
  seen_.clear();
  for (const auto& p : points) {
    const int x = TileOf(p.x()), y = TileOf(p.y());
    Tile& tile = Place(x, y);
    if (tile.sweep != sweep_) {
      tile.sweep = sweep_;
      tile.low = p.cast<double>();
      seen_.push_back(&tile);
    }
    if (p.z() < tile.low.z()) tile.low = p.cast<double>();
  }
  FollowPlane(origin);
  if (!started_) return;
  for (Tile* tile : seen_) {
    At(tile->x, tile->y);
    // The lowest of many noisy returns lies below.
    const double z = tile->low.z() + 0.25 * kLayer - Rise(*tile, tile->low.x(), tile->low.y());
    if (std::abs(z - tile->estimate) > config_.step) continue;
    // Feet of walls must not lift the ground, sweep by sweep or tile by tile: what surrounds a tile
    // limits it.
    if (z - tile->surroundings > kUphill * config_.step) continue;
    tile->z = tile->known ? tile->z + kFollow * (z - tile->z) : z;
    tile->known = true;
  }
}

}  // namespace chase::mapping
