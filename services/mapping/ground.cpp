#include "services/mapping/ground.h"

#include <algorithm>
#include <cmath>

#include "services/mapping/voxel_grid.h"

namespace chase::mapping {

namespace {

constexpr double kNear = 12.0;    // m, returns that the start looks at
constexpr double kLayer = 0.12;   // m above the lowest return of a tile: taken for the ground
constexpr int kReach = 4;         // tiles, how far neighbours stand in
constexpr double kFollow = 0.25;  // share of a sweep's news that a tile takes over
constexpr double kUphill = 0.5;   // share of the step that a tile may stand out upward
constexpr size_t kFewest = 20;    // returns without which there is no start

}  // namespace

GroundModel::GroundModel(const GroundConfig& config)
    : config_(config), tiles_(static_cast<size_t>(kSide) * kSide) {}

int GroundModel::TileOf(double x) { return Floor(std::clamp(x, -1e8, 1e8)); }

GroundModel::Tile& GroundModel::At(int x, int y) {
  Tile& tile = tiles_[static_cast<size_t>((x & (kSide - 1)) * kSide + (y & (kSide - 1)))];
  if (tile.x != x || tile.y != y) {
    tile = Tile();
    tile.x = x;
    tile.y = y;
  }
  return tile;
}

std::optional<double> GroundModel::Known(int x, int y) const {
  const Tile& tile = tiles_[static_cast<size_t>((x & (kSide - 1)) * kSide + (y & (kSide - 1)))];
  if (tile.x != x || tile.y != y || !tile.known) return std::nullopt;
  return tile.z;
}

double GroundModel::Estimate(int x, int y) {
  Tile& tile = At(x, y);
  if (tile.cached == sweep_) return tile.estimate;
  const double estimate = tile.known ? tile.z : Surroundings(x, y);
  tile.estimate = estimate;
  tile.cached = sweep_;
  return estimate;
}

/// Mean of the known tiles around one, without itself: of the nearest two rings, else of the next.
double GroundModel::Surroundings(int x, int y) {
  double sum = 0.0;
  int n = 0;
  for (int ring = 1; ring <= kReach && (ring <= 2 || n == 0); ++ring) {
    for (int dx = -ring; dx <= ring; ++dx) {
      const int stride = std::abs(dx) == ring ? 1 : 2 * ring;
      for (int dy = -ring; dy <= ring; dy += stride) {
        const Tile& tile = tiles_[static_cast<size_t>(((x + dx) & (kSide - 1)) * kSide +
                                                      ((y + dy) & (kSide - 1)))];
        if (!tile.known || tile.x != x + dx || tile.y != y + dy) continue;
        sum += tile.z;
        ++n;
      }
    }
  }
  return n > 0 ? sum / n : mean_;
}

/// The lowest layer of returns near the sensor, where at least a twentieth of them lie.
void GroundModel::Start(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3d& origin) {
  std::vector<float> z;
  for (const auto& p : points)
    if ((p.head<2>() - origin.head<2>().cast<float>()).norm() < kNear) z.push_back(p.z());
  if (z.size() < kFewest) return;
  std::sort(z.begin(), z.end());
  const double low = z[z.size() / 20];
  const auto end = std::upper_bound(z.begin(), z.end(), static_cast<float>(low + kLayer));
  mean_ = z[static_cast<size_t>(end - z.begin()) / 2];
  started_ = true;
}

void GroundModel::Update(const std::vector<Eigen::Vector3f>& points,
                         const Eigen::Vector3d& origin) {
  if (!started_) Start(points, origin);
  if (!started_) return;
  ++sweep_;
  seen_.clear();
  for (const auto& p : points) {
    const int x = TileOf(p.x()), y = TileOf(p.y());
    if (std::abs(p.z() - Estimate(x, y)) > config_.step) continue;
    Tile& tile = At(x, y);
    if (tile.sweep != sweep_) {
      tile.sweep = sweep_;
      tile.low = p.z();
      seen_.push_back(&tile);
    }
    tile.low = std::min(tile.low, p.z());
  }
  double sum = 0.0;
  for (Tile* tile : seen_) {
    const double z = tile->low + 0.25 * kLayer;  // the lowest of many noisy returns lies below
    // Feet of walls must not lift the ground, sweep by sweep or tile by tile: what surrounds a tile
    // limits it.
    if (z - Surroundings(tile->x, tile->y) > kUphill * config_.step) continue;
    tile->z = tile->known ? tile->z + kFollow * (z - tile->z) : z;
    tile->known = true;
    sum += tile->z;
  }
  if (!seen_.empty()) mean_ += 0.1 * (sum / static_cast<double>(seen_.size()) - mean_);
}

}  // namespace chase::mapping
