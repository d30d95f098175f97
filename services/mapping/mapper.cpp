#include "services/mapping/mapper.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "services/mapping/forecast.h"
#include "services/mapping/ground_slabs.h"

namespace chase::mapping {

namespace {

constexpr int kSettledHits = 15;       // sweeps after which a cell outside the target's core stays
constexpr double kGhostMargin = 0.2;   // m around a mover within which doubtful cells are cleared
constexpr double kLookBack = 2.0;      // s after a mover became known that its way is cleared
constexpr double kPassedTime = 6.0;    // s of its way
constexpr double kStep = 0.2;          // m, over which a mover steps
constexpr double kOwnPlace = 0.6;      // m around the drone that are free since it is there
constexpr int kOwnLevels = 1;          // cells above and below it that count as its height
constexpr double kWindowMargin = 1.0;  // m beyond the list's radius that the decomposition sees
constexpr int kFirstUnseen = 1 << 29;  // ids beyond those of pieces and of the ground
constexpr double kMostCoordinate = 6000.0;  // m, what the octree's keys can hold at 0.2 m

/// Lower bound of the horizontal distance [m] from p to an upright solid, by the ellipse's support
/// function; negative within.
double LeastPlanDistance(const world::Obstacle& o, const Eigen::Vector3d& p) {
  const Eigen::Vector2d d = (p - o.center.coefficients.row(0).transpose()).head<2>();
  const Eigen::Matrix2d Q = o.shape.topLeftCorner<2, 2>().inverse();
  return d.norm() - std::sqrt(d.dot(Q * d)) / std::max(1e-9, d.norm());
}

/// What lies about as near to a mover as a cell is wide may be its own.
Ellipse Grown(const Ellipse& outline) {
  return outline.Scaled(1.0 + kGhostMargin / std::max(0.1, outline.SemiAxes().y()));
}

/// A column that is tighter than the ellipsoid: a cylinder or a box, whichever has the smaller
/// section.
void SetSolid(const Piece& piece, double semi_height, world::Obstacle* o) {
  const Rectangle& r = piece.rectangle;
  if (M_PI * piece.radius * piece.radius < r.Area()) {
    o->solid = world::Obstacle::Solid::kCylinder;
    o->half = {piece.radius, piece.radius, semi_height};
    return;
  }
  o->solid = world::Obstacle::Solid::kBox;
  o->half << r.half, semi_height;
  o->axes = Eigen::AngleAxisd(std::atan2(r.axes(1, 0), r.axes(0, 0)), Eigen::Vector3d::UnitZ());
}

}  // namespace

int KeepNearest(const Eigen::Vector3d& origin, int most, std::vector<world::Obstacle>* obstacles) {
  std::stable_sort(obstacles->begin(), obstacles->end(),
                   [&](const world::Obstacle& a, const world::Obstacle& b) {
                     return LeastPlanDistance(a, origin) < LeastPlanDistance(b, origin);
                   });
  const int cut = std::max(0, static_cast<int>(obstacles->size()) - most);
  obstacles->resize(obstacles->size() - static_cast<size_t>(cut));
  return cut;
}

Mapper::Mapper(const MappingConfig& config)
    : config_(config),
      grid_(config.grid.resolution),
      integrator_(config.grid, &grid_),
      ground_(config.ground),
      zone_(config.target),
      detector_(config.movers, config.grid),
      tracker_(config.movers),
      decomposition_(config.statics, config.grid.resolution),
      unseen_(config.statics, config.grid.resolution),
      tree_(config.grid.resolution) {}

/// Shortens a ray to the range and to the window's levels; true if it had to.
bool Mapper::Shorten(const Eigen::Vector3d& origin, Eigen::Vector3d* end) const {
  constexpr double kSurelyShorter = 1.0 - 1e-12;  // for most, neither root nor division is needed
  const Eigen::Vector3d d = *end - origin;
  const double low = grid_.resolution() * (grid_.z0() + 0.5);
  const double high = grid_.resolution() * (grid_.z0() + VoxelGrid::kLevels - 0.5);
  const double z = origin.z() + d.z(), range = config_.grid.range;
  if (d.squaredNorm() < kSurelyShorter * range * range && z >= low && z <= high) return false;
  double share = std::min(1.0, range / d.norm());
  if (origin.z() + share * d.z() > high) share = (high - origin.z()) / d.z();
  if (origin.z() + share * d.z() < low) share = (low - origin.z()) / d.z();
  if (share >= 1.0) return false;
  *end = origin + std::max(0.0, share) * d;
  return true;
}

void Mapper::Prepare(const Sweep& sweep) {
  returns_.clear();
  near_.clear();
  const double min2 = config_.grid.min_range * config_.grid.min_range;
  for (size_t i = 0; i < sweep.points.size(); ++i) {
    const Eigen::Vector3f& p = sweep.points[i];
    if (!p.allFinite()) continue;
    Eigen::Vector3d end = p.cast<double>();
    if ((end - sweep.origin).squaredNorm() < min2) continue;
    Return r;
    if (i < sweep.ages.size()) r.age = sweep.ages[i];
    r.label = Shorten(sweep.origin, &end) ? Label::kFar : Label::kStatic;
    r.p = end.cast<float>();
    r.key = grid_.ToKey(end);
    if (r.label == Label::kFar) r.key.x &= ~1, r.key.y &= ~1;  // rays end together: fewer of them
    if (!grid_.Contains(r.key)) continue;
    if (r.label == Label::kStatic) near_.push_back(r.p);
    returns_.push_back(r);
  }
  ground_.Update(near_, sweep.origin);
  for (auto& r : returns_)
    if (r.label == Label::kStatic && ground_.IsGround(r.p)) r.label = Label::kGround;
}

/// Returns near the target are its own, unless a settled cell outside its core explains them, or a
/// mover does better: the zone reaches as many deviations from the target as a mover's gate.
void Mapper::MarkTarget(const std::vector<Footprint>& movers) {
  if (!zone_.active()) return;
  const double sigma = (zone_.outer() - zone_.keep_out()) / config_.movers.gate;
  double excess = 0.0;
  for (auto& r : returns_) {
    if (r.label != Label::kStatic || !zone_.Holds(r.p)) continue;
    const Voxel* voxel = grid_.At(r.key);
    const bool settled = voxel && voxel->occupied && voxel->hits > kSettledHits;
    const double distance = (r.p.head<2>().cast<double>() - zone_.center()).norm();
    if (settled && distance >= zone_.core()) continue;
    if (NearestBody(movers, r, (distance - zone_.keep_out()) / sigma, &excess) < 0)
      r.label = Label::kTarget;
  }
}

void Mapper::TrackMovers(const Sweep& sweep, const std::vector<Footprint>& expected) {
  LowestRays rays;
  rays.axis = sweep.axis;
  rays.height = sweep.origin.z() - ground_.Height(sweep.origin.x(), sweep.origin.y());
  rays.range = config_.grid.range;
  auto clusters = detector_.Detect(sweep.origin, rays, returns_, &grid_, expected);
  tracker_.Update(detector_.panorama(), &clusters);
  for (const auto& cluster : clusters) {
    if (!tracker_.Moves(cluster.track)) continue;
    for (const int i : cluster.members) returns_[static_cast<size_t>(i)].label = Label::kMoving;
  }
}

/// Empties cells where the target or a mover is, or a mover was before it was known as one.
void Mapper::ClearGhosts(double t) {
  if (zone_.active()) {
    const double bottom = ground_.Height(zone_.center().x(), zone_.center().y());
    integrator_.ClearDisc(zone_.center(), zone_.outer(), bottom, zone_.top(), kSettledHits, false);
    if (zone_.in_view())
      integrator_.ClearDisc(zone_.center(), zone_.core(), bottom, zone_.top(), 255, true);
  }
  for (const auto& track : tracker_.tracks()) {
    if (!track.confirmed || !tracker_.Moves(track.id)) continue;
    const double radius = track.reach + kGhostMargin;
    const double bottom = track.z - 5.0, top = track.z + 5.0;
    const auto clear = [&](const Eigen::Vector2d& place) {
      const Ellipse around = Grown({place + track.outline.center, track.outline.shape});
      integrator_.ClearDisc(place, radius, bottom, top, kSettledHits, false, &around);
    };
    clear(track.body.p());
    if (track.fresh)
      for (const auto& place : track.trail) clear(place);
    if (t - track.known > kLookBack || !(t > t_)) continue;
    integrator_.ClearPassed(Grown(track.Outline()), (t - t_) * track.body.v(),
                            kPassedTime / (t - t_), bottom, top);
  }
}

/// Extent in plan of a column's occupied cells within the flight volume; false if there are none.
bool Mapper::ColumnExtent(const VoxelGrid::Column& column, Extent* extent) {
  const Eigen::Vector3d center = grid_.Center({column.x, column.y, column.z0});
  const double ground = ground_.Height(center.x(), center.y());
  const double low = ground + config_.statics.band_low, high = ground + config_.statics.band_high;
  *extent = Extent::Nothing();
  for (int i = 0; i < VoxelGrid::kLevels; ++i) {
    const Voxel& voxel = column.voxels[VoxelGrid::Level(column.z0 + i)];
    if (!voxel.occupied || voxel.extent.empty()) continue;
    const double z = center.z() + grid_.resolution() * i;
    if (z + grid_.step() * voxel.extent.high[4] < low) continue;
    if (z + grid_.step() * voxel.extent.low[4] > high) break;
    *extent = Union(*extent, voxel.extent);
  }
  return !extent->empty();
}

/// A column of which nothing was seen at the drone's own height and nothing is listed. The drone's
/// own place is known to be free.
bool Mapper::IsUnseen(const Key& key, const Eigen::Vector3d& origin) {
  const Eigen::Vector2d center = grid_.Center(key).head<2>();
  const double distance = (center - origin.head<2>()).norm();
  if (distance > config_.statics.unseen || distance < kOwnPlace) return false;
  if (zone_.in_view() && (center - zone_.center()).norm() < zone_.outer()) return false;
  const VoxelGrid::Column* column = grid_.Find(key.x, key.y);
  if (!column) return true;
  if (Extent e; column->occupied > 0 && ColumnExtent(*column, &e)) return false;  // listed
  for (int z = key.z - kOwnLevels; z <= key.z + kOwnLevels; ++z)
    if (grid_.ContainsLevel(z) && column->voxels[VoxelGrid::Level(z)].sweep > 0) return false;
  return true;
}

/// Columns within the list's radius and a margin. `partial`: pieces with columns beyond that too.
std::vector<Cell> Mapper::OccupiedColumns(const Eigen::Vector3d& origin, std::set<int>* partial) {
  std::vector<Cell> cells;
  const double reach = config_.statics.radius + kWindowMargin;
  const Key middle = grid_.ToKey(origin);
  const int n =
      static_cast<int>(std::ceil((reach + config_.statics.max_length) / grid_.resolution()));
  std::array<Eigen::Vector2d, 8> corners;
  Extent extent;
  for (int x = middle.x - n; x <= middle.x + n; ++x) {
    for (int y = middle.y - n; y <= middle.y + n; ++y) {
      VoxelGrid::Column* column = grid_.Find(x, y);
      const Eigen::Vector2d center = grid_.Center({x, y, 0}).head<2>();
      if ((center - origin.head<2>()).norm() > reach) {
        if (column && column->piece && column->occupied > 0) partial->insert(column->piece);
        continue;
      }
      if (!column) continue;
      if (column->occupied == 0 || !ColumnExtent(*column, &extent)) {
        column->piece = 0;
        continue;
      }
      Cell cell{x, y, column->piece, {}, 0.0};
      const int k = PlanCorners(extent, center, grid_.step(), &corners);
      cell.corners.assign(corners.begin(), corners.begin() + k);
      cell.area = std::pow(grid_.step(), 2) * (extent.high[0] - extent.low[0]) *
                  (extent.high[1] - extent.low[1]);
      cells.push_back(std::move(cell));
    }
  }
  return cells;
}

std::vector<world::Obstacle> Mapper::Statics(const Eigen::Vector3d& origin, double t,
                                             int* dropped) {
  std::set<int> partial;
  auto cells = OccupiedColumns(origin, &partial);
  const Eigen::Vector2d target = zone_.center();
  const auto pieces =
      decomposition_.Update(&cells, partial, zone_.in_view() ? &target : nullptr, zone_.keep_out());
  *dropped = decomposition_.dropped();
  for (const auto& cell : cells) grid_.Touch(cell.x, cell.y).piece = cell.piece;
  std::vector<world::Obstacle> obstacles;
  for (const auto& piece : pieces) {
    world::Obstacle o = Upright(piece.id, piece.outline, t);
    SetSolid(piece, config_.statics.semi_height, &o);
    if (LeastPlanDistance(o, origin) <= config_.statics.radius && o.shape.allFinite())
      obstacles.push_back(std::move(o));
  }
  // Until it is known how they move they are listed where they are.
  for (const Track* track : tracker_.Unconfirmed()) {
    world::Obstacle o = Upright(track->id, track->Outline(), t);
    if (LeastPlanDistance(o, origin) <= config_.statics.radius && o.shape.allFinite())
      obstacles.push_back(std::move(o));
  }
  return obstacles;
}

/// Through the flight volume.
world::Obstacle Mapper::Upright(int id, const Ellipse& outline, double t) {
  const StaticConfig& c = config_.statics;
  const double half_band = 0.5 * (c.band_high - c.band_low);
  // The ellipsoid's section must hold the outline at both ends of the flight volume.
  const double grow = 1.0 / std::sqrt(1.0 - std::pow(half_band / c.semi_height, 2));
  world::Obstacle o;
  o.id = id;
  Eigen::Vector3d center;
  center << outline.center,
      ground_.Height(outline.center.x(), outline.center.y()) + c.band_low + half_band;
  o.center = world::Trajectory::Constant(center, t, config_.movers.horizon);
  o.shape.setZero();
  o.shape.topLeftCorner<2, 2>() = outline.Scaled(grow).shape;
  o.shape(2, 2) = 1.0 / (c.semi_height * c.semi_height);
  return o;
}

std::vector<world::Obstacle> Mapper::Unseen(const Eigen::Vector3d& origin, double t) {
  const double resolution = grid_.resolution();
  const Key middle = grid_.ToKey(origin);
  const int n = static_cast<int>(std::ceil(config_.statics.unseen / resolution));
  std::vector<Cell> cells;
  for (int x = middle.x - n; x <= middle.x + n; ++x) {
    for (int y = middle.y - n; y <= middle.y + n; ++y) {
      if (!IsUnseen({x, y, middle.z}, origin)) continue;
      const auto piece = unseen_pieces_.find({x, y});
      Cell cell{
          x, y, piece == unseen_pieces_.end() ? 0 : piece->second, {}, resolution * resolution};
      for (const int i : {0, 1})
        for (const int j : {0, 1})
          cell.corners.emplace_back(resolution * (x + i), resolution * (y + j));
      cells.push_back(std::move(cell));
    }
  }
  const auto pieces = unseen_.Update(&cells, {}, nullptr, 0.0);
  unseen_pieces_.clear();
  for (const auto& cell : cells) unseen_pieces_[{cell.x, cell.y}] = cell.piece;
  std::vector<world::Obstacle> unseen;
  for (const auto& piece : pieces) {
    world::Obstacle o = Upright(kFirstUnseen + piece.id, piece.outline, t);
    SetSolid(piece, config_.statics.semi_height, &o);
    if (o.shape.allFinite()) unseen.push_back(std::move(o));
  }
  return unseen;
}

/// Nothing walks through what stands: a mover's forecast ends where its whole front meets it. What
/// is above or below what is seen of the mover is not in its way.
void Mapper::StopAtWalls(world::Obstacle* mover) {
  const Track* track = tracker_.Find(mover->id);
  const Eigen::Vector2d p = mover->center.coefficients.row(0).head<2>();
  const Eigen::Vector2d way = mover->center.coefficients.row(1).head<2>();
  const double length = way.norm();
  if (!track || !(length > 0.0)) return;
  const double low = std::max(ground_.Height(p.x(), p.y()) + config_.statics.band_low,
                              track->z - track->half_height + kStep);
  const double high = std::max(low, track->z + track->half_height);
  StopAfter(FreeWay(Ellipse{p, mover->shape.topLeftCorner<2, 2>()}, way / length, length, low, high,
                    &grid_),
            mover);
}

ObstacleList Mapper::Insert(const Sweep& sweep) {
  ObstacleList list;
  if (!(sweep.origin.cwiseAbs().maxCoeff() < kMostCoordinate)) return list;
  origin_ = sweep.origin;
  grid_.MoveTo(sweep.origin);
  zone_.MoveTo(sweep.t);
  Prepare(sweep);
  tracker_.Predict(sweep.t);
  if (zone_.active()) tracker_.Forget(zone_.center(), zone_.keep_out(), zone_.outer());
  const auto expected = tracker_.Expected();
  MarkTarget(expected);
  TrackMovers(sweep, expected);
  integrator_.Insert(sweep.origin, returns_);
  ClearGhosts(sweep.t);
  t_ = sweep.t;
  list.obstacles = Statics(sweep.origin, sweep.t, &list.n_dropped);
  if (config_.statics.unseen > 0.0) list.unseen = Unseen(sweep.origin, sweep.t);
  const StaticConfig& c = config_.statics;
  list.n_static = static_cast<int>(list.obstacles.size());
  const double middle =
      ground_.Height(sweep.origin.x(), sweep.origin.y()) + 0.5 * (c.band_low + c.band_high);
  for (auto& o : tracker_.Obstacles(middle, c.semi_height, 1.02)) {
    if (LeastPlanDistance(o, sweep.origin) > config_.grid.range) continue;
    ++list.n_moving;
    StopAtWalls(&o);
    list.obstacles.push_back(std::move(o));
  }
  list.n_cut = KeepNearest(sweep.origin, config_.max_obstacles, &list.obstacles);
  for (auto& slab :
       GroundSlabs(ground_, sweep.origin, c.radius, c.band_low, sweep.t, config_.movers.horizon))
    list.obstacles.push_back(std::move(slab));
  return list;
}

void Mapper::SetTree(int most) {
  auto& changes = integrator_.changes();
  for (int i = 0; i < most && !changes.empty(); ++i) {
    grid_.Prefetch(changes[std::min(VoxelGrid::kAhead, changes.size() - 1)]);
    const Key key = changes.front();
    changes.pop_front();
    Voxel* voxel = grid_.At(key);
    if (!voxel || !voxel->queued) continue;  // rolled out of the window meanwhile
    voxel->queued = false;
    tree_.Set(key, voxel->occupied);
  }
}

void Mapper::UpdateTree() {
  SetTree(config_.tree.updates_per_sweep);
  tree_.Forget(origin_, config_.tree.keep_radius, config_.tree.keep_tiles ? &tiles_ : nullptr);
}

void Mapper::CompleteTree() { SetTree(static_cast<int>(integrator_.changes().size())); }

std::vector<SavedTile> Mapper::TakeTiles() { return std::exchange(tiles_, {}); }

size_t Mapper::Bytes() const { return grid_.Bytes() + tree_.Bytes(); }

}  // namespace chase::mapping
