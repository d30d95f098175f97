#include "services/odometry/surface_map.h"

#include <Eigen/Eigenvalues>
#include <algorithm>

namespace chase::odometry {

namespace {

// A plane must be seen in two directions: the smaller extent is at least this share of the cell and
// well above its thickness. A line is the reverse.
constexpr float kPlaneExtent = 0.10f;
constexpr float kPlaneFlatness = 6.0f;  // variance along over variance across
constexpr float kLineExtent = 0.15f;
constexpr float kLineStraightness = 9.0f;

// Floors and walls tend to lie at round distances from the origin. On the border of two cells, each
// would learn the half of the noise that falls into it.
const Eigen::Vector3f kShift(0.382f, 0.427f, 0.464f);

}  // namespace

SurfaceMap::SurfaceMap(const MapConfig& config, SurfaceKind kind) : config_(config), kind_(kind) {
  levels_.resize(static_cast<size_t>(config.levels));
  float size = static_cast<float>(config.cell_size);
  for (Level& level : levels_) {
    level.size = size;
    level.shift = size * kShift;
    // All its memory is touched now, so that none has to be found in flight.
    level.cells.resize(static_cast<size_t>(config.max_cells));
    level.cells.clear();
    size *= 2.0f;
  }
}

void SurfaceMap::Add(const Eigen::Vector3f& p) {
  for (Level& level : levels_) {
    if (static_cast<int>(level.cells.size()) >= config_.max_cells) continue;
    bool added = false;
    const int number = level.index.FindOrAdd(level.Key(p), &added);
    if (added) {
      level.cells.emplace_back();
      level.cells.back().origin = p;
    }
    Cell& cell = level.cells[static_cast<size_t>(number)];
    if (cell.n >= config_.max_points) continue;
    const Eigen::Vector3f d = p - cell.origin;
    cell.sum += d;
    cell.outer.noalias() += d * d.transpose();
    if (++cell.n >= cell.next_fit) Fit(level, &cell);
  }
}

void SurfaceMap::Fit(const Level& level, Cell* cell) const {
  cell->next_fit = cell->n + std::max(1, cell->n / 4);
  const double n = cell->n;
  const Eigen::Vector3d mean = cell->sum.cast<double>() / n;
  const Eigen::Matrix3d covariance = cell->outer.cast<double>() / n - mean * mean.transpose();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(covariance);
  const Eigen::Vector3f lambda = eigen.eigenvalues().cast<float>().cwiseMax(1e-8f);
  const float thickness = static_cast<float>(config_.plane_thickness);
  const float extent = (kind_ == SurfaceKind::kPlane ? kPlaneExtent : kLineExtent) * level.size;
  cell->surface.center = cell->origin + mean.cast<float>();
  if (kind_ == SurfaceKind::kPlane) {
    cell->valid = lambda[0] < thickness * thickness && lambda[1] > extent * extent &&
                  lambda[1] > kPlaneFlatness * lambda[0];
    cell->surface.direction = eigen.eigenvectors().col(0).cast<float>();
    cell->surface.variance = lambda[0];
  } else {
    cell->valid = lambda[1] < 2.0f * thickness * thickness && lambda[2] > extent * extent &&
                  lambda[2] > kLineStraightness * lambda[1];
    cell->surface.direction = eigen.eigenvectors().col(2).cast<float>();
    cell->surface.variance = 0.5f * (lambda[0] + lambda[1]);
  }
}

const Surface* SurfaceMap::Find(const Eigen::Vector3f& p) const {
  for (const Level& level : levels_) {
    const int number = level.index.Find(level.Key(p));
    if (number == CellIndex::kNone) continue;
    const Cell& cell = level.cells[static_cast<size_t>(number)];
    if (cell.valid) return &cell.surface;
  }
  return nullptr;
}

void SurfaceMap::Prune(const Eigen::Vector3f& center) {
  for (Level& level : levels_)
    if (10 * level.cells.size() >= 9 * static_cast<size_t>(config_.max_cells))
      PruneLevel(center, &level);
}

/// In place: a map that was full once allocates no more.
void SurfaceMap::PruneLevel(const Eigen::Vector3f& center, Level* level) {
  float range = static_cast<float>(config_.keep_range);
  do {  // a dense world may need a shorter range to make room
    const auto far = [&](const Cell& cell) {
      return (cell.origin - center).squaredNorm() > range * range;
    };
    level->cells.erase(std::remove_if(level->cells.begin(), level->cells.end(), far),
                       level->cells.end());
    range *= 0.8f;
  } while (10 * level->cells.size() > 7 * static_cast<size_t>(config_.max_cells) && range > 1.0f);
  level->index.Clear();
  bool added = false;
  for (const Cell& cell : level->cells) level->index.FindOrAdd(level->Key(cell.origin), &added);
}

void SurfaceMap::Clear() {
  for (Level& level : levels_) {
    level.cells.clear();
    level.index.Clear();
  }
}

size_t SurfaceMap::cells() const {
  size_t n = 0;
  for (const Level& level : levels_) n += level.cells.size();
  return n;
}

size_t SurfaceMap::MemoryBytes() const {
  size_t bytes = 0;
  for (const Level& level : levels_)
    bytes += level.index.MemoryBytes() + level.cells.capacity() * sizeof(Cell);
  return bytes;
}

}  // namespace chase::odometry
