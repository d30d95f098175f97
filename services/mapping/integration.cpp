#include "services/mapping/integration.h"

#include <algorithm>
#include <cmath>

namespace chase::mapping {

namespace {

constexpr double kNoise = 0.08;     // m, an interval's difference that may be noise
constexpr double kNearMiss = 0.35;  // cells, a ray this near to a cell's returns contradicts them
constexpr int kLowShare = 3;        // free cells keep limit / this, so that they can fill again
constexpr int kNewlyFree = 2;       // free sweeps after which the octree is told
constexpr int kSettleSweeps = 20;   // moving returns this long in one cell stand still
constexpr int kDoubtSweeps = 10;    // hits after which a cell that was long free is no longer
constexpr double kPassed = 2.0;     // sweeps, how well it is known when a body was somewhere
constexpr int kPassedHits = 4;      // sweeps that a cell may be hit beyond the body's stay
constexpr size_t kMostChanges = 400000;

uint8_t Increment(uint8_t n) { return n < 255 ? static_cast<uint8_t>(n + 1) : n; }

}  // namespace

void Integrator::Insert(const Eigen::Vector3d& origin, const std::vector<Return>& returns) {
  ++sweep_;
  grid_.SettledFree(&done_);
  Gather(returns);
  for (auto& cell : cells_) Hit(&cell);
  for (size_t first = 0; first < cells_.size(); first += kRaysAtOnce)
    CastRays(origin, first, std::min(cells_.size() - first, size_t{kRaysAtOnce}));
}

void Integrator::Gather(const std::vector<Return>& returns) {
  cells_.clear();
  for (size_t i = 0; i < returns.size(); ++i) {
    const Return& r = returns[i];
    grid_.Prefetch(returns[std::min(i + VoxelGrid::kAhead, returns.size() - 1)].key);
    auto& column = grid_.Touch(r.key.x, r.key.y);
    Voxel& voxel = column.voxels[VoxelGrid::Level(r.key.z)];
    const size_t slot = static_cast<size_t>(voxel.slot);
    if (slot >= cells_.size() || cells_[slot].voxel != &voxel) {
      voxel.slot = static_cast<int32_t>(cells_.size());
      cells_.emplace_back();
      cells_.back().key = r.key;
      cells_.back().column = &column;
      cells_.back().voxel = &voxel;
    }
    HitCell& cell = cells_[static_cast<size_t>(voxel.slot)];
    cell.sum += r.p;
    ++cell.count;
    cell.ground += r.label == Label::kGround;
    cell.moving += r.label == Label::kMoving;
    if (r.label != Label::kStatic) continue;
    ++cell.solid;
    cell.meter.Add(r.p - grid_.Center(r.key).cast<float>());
  }
}

void Integrator::Hit(HitCell* cell) {
  Voxel& voxel = *cell->voxel;
  if (cell->solid + cell->ground + cell->moving == 0) return;
  const size_t index = VoxelGrid::Index(cell->key.x, cell->key.y);
  done_.Add(grid_.Number(cell->key));
  grid_.settled_free()[index] &= ~VoxelGrid::Bit(cell->key.z);
  voxel.sweep = sweep_;
  if (cell->solid + cell->ground == 0) {
    voxel.moving_hits = Increment(voxel.moving_hits);
    if (voxel.moving_hits >= kSettleSweeps) voxel.free_sweeps = 0;
    return;
  }
  const bool strong = cell->solid + cell->ground >= 2;
  voxel.hit_sweep = sweep_;
  voxel.hits = Increment(voxel.hits);
  const bool doubted = voxel.free_sweeps >= config_.ever_free_sweeps && voxel.hits < kDoubtSweeps;
  if (cell->solid == 0 || !doubted) voxel.free_sweeps = 0;
  voxel.log_odds =
      static_cast<int8_t>(std::min(config_.limit, voxel.log_odds + (strong ? 2 : 1) * config_.hit));
  const bool had_extent = !voxel.extent.empty();
  if (cell->solid > 0) Follow(cell->meter, grid_.step(), kNoise, &voxel.extent);
  if (!voxel.occupied && voxel.log_odds >= config_.occupied)
    SetOccupied(cell->column, &voxel, cell->key);
  else if (voxel.occupied && !had_extent && cell->solid > 0)
    ++cell->column->occupied;
}

void Integrator::SetOccupied(VoxelGrid::Column* column, Voxel* voxel, const Key& key) {
  voxel->occupied = true;
  if (!voxel->extent.empty()) ++column->occupied;
  Queue(voxel, key);
}

void Integrator::Reset(VoxelGrid::Column* column, Voxel* voxel, const Key& key) {
  if (voxel->occupied) {
    if (!voxel->extent.empty()) --column->occupied;
    voxel->occupied = false;
    Queue(voxel, key);
  }
  voxel->extent = Extent::Nothing();
  voxel->hits = 0;
  voxel->log_odds = static_cast<int8_t>(std::min<int>(voxel->log_odds, 0));
}

void Integrator::Queue(Voxel* voxel, const Key& key) {
  if (voxel->queued || changes_.size() >= kMostChanges) return;
  voxel->queued = true;
  if (!voxel->occupied)
    changes_.push_back(key);
  else
    changes_.push_front(key);  // news of obstacles first
}

bool Integrator::PassesReturns(const Voxel& voxel, const Key& key) const {
  const Extent& e = voxel.extent;
  const Eigen::Vector3d middle(e.low[0] + e.high[0], e.low[1] + e.high[1], e.low[4] + e.high[4]);
  const Eigen::Vector3d d = grid_.Center(key) + 0.5 * grid_.step() * middle - ray_origin_;
  const double squared = d.squaredNorm() - std::pow(d.dot(ray_direction_), 2);
  return squared < std::pow(kNearMiss * grid_.resolution(), 2);
}

/// Height of the ray above the cell's centre where it is nearest to it, in steps.
int8_t Integrator::PassingHeight(const Key& key) const {
  const Eigen::Vector3d d = grid_.Center(key) - ray_origin_;
  const double above = d.dot(ray_direction_) * ray_direction_.z() - d.z();
  return static_cast<int8_t>(std::clamp(std::round(above / grid_.step()), -127.0, 127.0));
}

void Integrator::Miss(const Key& key) {
  VoxelGrid::Column& column = grid_.Touch(key.x, key.y);
  Voxel& voxel = column.voxels[VoxelGrid::Level(key.z)];
  if (!voxel.extent.empty() && !PassesReturns(voxel, key)) return;
  const size_t index = VoxelGrid::Index(key.x, key.y);
  done_.Add(grid_.Number(key));
  voxel.sweep = sweep_;
  voxel.moving_hits = 0;
  const int least = -config_.limit / kLowShare;
  voxel.log_odds = static_cast<int8_t>(std::max(least, voxel.log_odds + config_.miss));
  if (voxel.log_odds > 0) return;
  if (voxel.hits > 0) Reset(&column, &voxel, key);
  const int8_t height = PassingHeight(key);
  voxel.free_down_to = voxel.free_sweeps == 0 ? height : std::min(voxel.free_down_to, height);
  voxel.free_sweeps = Increment(voxel.free_sweeps);
  if (voxel.free_sweeps == kNewlyFree) Queue(&voxel, key);
  if (voxel.log_odds == least &&
      voxel.free_sweeps >= std::max(kNewlyFree, config_.ever_free_sweeps))
    grid_.settled_free()[index] |= VoxelGrid::Bit(key.z);
}

/// From the origin to where the returns of some hit cells are. What lies between is in the window
/// too. All of them are walked first; so a ray looks once more for cells that one before it has
/// done.
void Integrator::CastRays(const Eigen::Vector3d& origin, size_t first, size_t n) {
  RayEnd ends[kRaysAtOnce];
  for (size_t i = 0; i < n; ++i) {
    const HitCell& cell = cells_[first + i];
    ends[i] = {(cell.sum / static_cast<float>(cell.count)).cast<double>(), cell.key};
  }
  WalkRays(grid_, origin, ends, static_cast<int>(n), done_, crossed_);
  for (size_t i = 0; i < n; ++i)
    for (int k = 0; k < crossed_[i].count; ++k) grid_.Prefetch(grid_.KeyOf(crossed_[i].cells[k]));
  ray_origin_ = origin;
  for (size_t i = 0; i < n; ++i) {
    const Eigen::Vector3d d = ends[i].p - origin;
    ray_direction_ = d / d.norm();
    for (int k = 0; k < crossed_[i].count; ++k)
      if (const int cell = crossed_[i].cells[k]; !done_.Has(cell)) Miss(grid_.KeyOf(cell));
  }
}

void Integrator::ClearDisc(const Eigen::Vector2d& center, double radius, double bottom, double top,
                           int settled, bool also_hit, const Ellipse* within) {
  const Eigen::Vector3d reach(radius, radius, 0.0);
  const Key low = grid_.ToKey(Eigen::Vector3d(center.x(), center.y(), bottom) - reach);
  const Key high = grid_.ToKey(Eigen::Vector3d(center.x(), center.y(), top) + reach);
  for (int x = low.x; x <= high.x; ++x) {
    for (int y = low.y; y <= high.y; ++y) {
      VoxelGrid::Column* column = grid_.Find(x, y);
      if (!column || column->occupied == 0) continue;
      const Eigen::Vector2d d = grid_.Center({x, y, 0}).head<2>() - center;
      if (d.squaredNorm() > radius * radius || (within && within->Level(center + d) > 1.0))
        continue;
      for (int z = low.z; z <= high.z; ++z) {
        if (!grid_.ContainsLevel(z)) continue;
        Voxel& voxel = column->voxels[VoxelGrid::Level(z)];
        if (voxel.hits > settled || (voxel.sweep == sweep_ && voxel.hits > 0 && !also_hit))
          continue;
        Reset(column, &voxel, {x, y, z});
      }
    }
  }
}

void Integrator::ClearPassed(const Ellipse& outline, const Eigen::Vector2d& step, double most,
                             double bottom, double top) {
  const Eigen::Vector2d end = outline.center - most * step;
  const double reach = outline.SemiAxes().x();
  const Eigen::Array2d first = outline.center.array().min(end.array()) - reach;
  const Eigen::Array2d last = outline.center.array().max(end.array()) + reach;
  const Key low = grid_.ToKey(Eigen::Vector3d(first.x(), first.y(), bottom));
  const Key high = grid_.ToKey(Eigen::Vector3d(last.x(), last.y(), top));
  const double a = step.dot(outline.shape * step);
  if (!(a > 0.0)) return;
  for (int x = low.x; x <= high.x; ++x) {
    for (int y = low.y; y <= high.y; ++y) {
      VoxelGrid::Column* column = grid_.Find(x, y);
      if (!column || column->occupied == 0) continue;
      // The body lay here while d + age step was within its outline.
      const Eigen::Vector2d d = grid_.Center({x, y, 0}).head<2>() - outline.center;
      const double b = d.dot(outline.shape * step);
      const double root = b * b - a * (d.dot(outline.shape * d) - 1.0);
      if (root <= 0.0 || b > 0.0) continue;
      const double left = (-b - std::sqrt(root)) / a, came = (-b + std::sqrt(root)) / a;
      if (left > most) continue;
      for (int z = low.z; z <= high.z; ++z) {
        if (!grid_.ContainsLevel(z)) continue;
        Voxel& voxel = column->voxels[VoxelGrid::Level(z)];
        const double age = static_cast<double>(sweep_) - static_cast<double>(voxel.hit_sweep);
        if (voxel.hits > 0 && voxel.hits < came - left + kPassedHits && age >= 1.0 &&
            age > left - kPassed && age < came + kPassed)
          Reset(column, &voxel, {x, y, z});
      }
    }
  }
}

}  // namespace chase::mapping
