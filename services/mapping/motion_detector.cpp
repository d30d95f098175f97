#include <algorithm>
#include <cmath>

#include "services/mapping/movers.h"

namespace chase::mapping {

namespace {

constexpr int kSettledHits = 15;       // sweeps after which an occupied cell is not doubted
constexpr double kLeastDepth = 0.4;    // of a mover's width over its length
constexpr double kFewestSeeds = 0.25;  // share of a cluster's returns in ever-free space

int64_t Code(int x, int y) {
  return (static_cast<int64_t>(x) << 32) + (static_cast<int64_t>(y) + (1LL << 31));
}

bool Inside(const std::vector<Ellipse>& outlines, const Eigen::Vector2d& p) {
  return std::any_of(outlines.begin(), outlines.end(),
                     [&](const Ellipse& e) { return e.Level(p) <= 1.0; });
}

}  // namespace

/// Long free, and so are the cells around: noise of a surface nearby never looks like motion.
bool MotionDetector::InEverFree(const Key& key, VoxelGrid* grid) const {
  const Voxel* voxel = grid->At(key);
  if (!voxel || voxel->free_sweeps < ever_free_) return false;
  for (int dx = -1; dx <= 1; ++dx)
    for (int dy = -1; dy <= 1; ++dy)
      for (int dz = -1; dz <= 1; ++dz) {
        const Voxel* near = grid->At({key.x + dx, key.y + dy, key.z + dz});
        if (near && near->free_sweeps < ever_free_ && (near->occupied || near->log_odds > 0))
          return false;
      }
  return true;
}

std::vector<MotionDetector::Candidate> MotionDetector::Candidates(
    const std::vector<Return>& returns, VoxelGrid* grid,
    const std::vector<Ellipse>& expected) const {
  std::vector<Candidate> candidates;
  for (size_t i = 0; i < returns.size(); ++i) {
    const Return& r = returns[i];
    if (r.label != Label::kStatic) continue;
    const Voxel* voxel = grid->At(r.key);
    const Eigen::Vector2d p = r.p.head<2>().cast<double>();
    const bool awaited = !expected.empty() && Inside(expected, p);
    const bool doubted =
        voxel && (voxel->free_sweeps >= ever_free_ || (awaited && voxel->hits < kSettledHits));
    if (voxel && voxel->occupied && !doubted) continue;
    const bool seed = awaited || InEverFree(r.key, grid);
    candidates.push_back({Code(static_cast<int>(std::floor(p.x() / config_.cluster_cell)),
                               static_cast<int>(std::floor(p.y() / config_.cluster_cell))),
                          static_cast<int>(i), seed});
  }
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.cell != b.cell ? a.cell < b.cell : a.index < b.index;
  });
  return candidates;
}

/// The hull of what was seen, and a little beyond on the side that faces away: of a mover seen from
/// one side only, a thin shell would be tracked as if there were nothing behind.
bool MotionDetector::Finish(const Eigen::Vector3d& origin, const std::vector<Return>& returns,
                            Cluster* cluster) const {
  if (static_cast<int>(cluster->members.size()) < config_.min_points) return false;
  Points2 points;
  float low = INFINITY, high = -INFINITY;
  for (const int i : cluster->members) {
    const auto& p = returns[static_cast<size_t>(i)].p;
    points.push_back(p.head<2>().cast<double>());
    low = std::min(low, p.z());
    high = std::max(high, p.z());
  }
  cluster->hull = ConvexHull(std::move(points));
  Rectangle box = SmallestRectangle(cluster->hull);
  const double missing = 2.0 * (kLeastDepth * box.half.x() - box.half.y());
  if (missing > 0.0) {
    Eigen::Vector2d away = box.axes.col(1);
    if (away.dot(box.center - origin.head<2>()) < 0.0) away = -away;
    for (const double side : {-1.0, 1.0})
      cluster->hull.push_back(box.center + side * box.half.x() * box.axes.col(0) +
                              (box.half.y() + missing) * away);
    cluster->hull = ConvexHull(cluster->hull);
    box.center += 0.5 * missing * away;
  }
  cluster->center << box.center, 0.5 * (low + high);
  cluster->half_length = box.half.x();
  return 2.0 * box.half.x() <= config_.max_size;
}

std::vector<Cluster> MotionDetector::Detect(const Eigen::Vector3d& origin,
                                            const std::vector<Return>& returns, VoxelGrid* grid,
                                            const std::vector<Ellipse>& expected) const {
  const auto candidates = Candidates(returns, grid, expected);
  struct Bin {
    int64_t cell;
    size_t first, last;
    int seeds;
    bool taken;
  };
  std::vector<Bin> bins;
  for (size_t i = 0; i < candidates.size(); ++i) {
    if (bins.empty() || bins.back().cell != candidates[i].cell)
      bins.push_back({candidates[i].cell, i, i, 0, false});
    bins.back().last = i + 1;
    bins.back().seeds += candidates[i].seed;
  }
  const auto find = [&](int64_t cell) {
    const auto it = std::lower_bound(bins.begin(), bins.end(), cell,
                                     [](const Bin& bin, int64_t c) { return bin.cell < c; });
    return it != bins.end() && it->cell == cell ? &*it : nullptr;
  };
  std::vector<Cluster> clusters;
  for (auto& start : bins) {
    if (start.taken || start.seeds == 0) continue;
    start.taken = true;
    std::vector<Bin*> front{&start};
    Cluster cluster;
    int seeds = 0;
    for (size_t head = 0; head < front.size(); ++head) {
      seeds += front[head]->seeds;
      for (size_t i = front[head]->first; i < front[head]->last; ++i)
        cluster.members.push_back(candidates[i].index);
      if (front[head]->seeds == 0) continue;  // the rim grows no further
      for (int dx = -1; dx <= 1; ++dx)
        for (int dy = -1; dy <= 1; ++dy) {
          Bin* bin = find(front[head]->cell + (static_cast<int64_t>(dx) << 32) + dy);
          if (!bin || bin->taken) continue;
          bin->taken = true;
          front.push_back(bin);
        }
    }
    if (seeds < kFewestSeeds * static_cast<double>(cluster.members.size())) continue;
    if (Finish(origin, returns, &cluster)) clusters.push_back(std::move(cluster));
  }
  return clusters;
}

}  // namespace chase::mapping
