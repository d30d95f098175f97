#include "services/mapping/motion_detector.h"

#include <algorithm>
#include <cmath>

namespace chase::mapping {

namespace {

constexpr int kSettledHits = 15;       // sweeps after which an occupied cell is not doubted
constexpr double kLeastDepth = 0.4;    // of a mover's width over its length
constexpr double kFewestSeeds = 0.25;  // share of a cluster's returns in ever-free space
constexpr float kLevel = 0.1f;         // m, less than this a level surface's returns span
constexpr double kGrazing = -0.35;     // cosine of the view on an end beyond which it is unseen
constexpr float kTouch = 0.4f;         // m, so near to other returns nothing ends
constexpr double kRim = 0.5;           // m, so near to the range nothing ends

int64_t Code(int x, int y) {
  return (static_cast<int64_t>(x) << 32) + (static_cast<int64_t>(y) + (1LL << 31));
}

/// A column of the sorted list, or one next to it.
bool Beside(const std::vector<int64_t>& columns, const Key& key) {
  for (int dx = -1; dx <= 1; ++dx) {
    const auto it = std::lower_bound(columns.begin(), columns.end(), Code(key.x + dx, key.y - 1));
    if (it != columns.end() && *it <= Code(key.x + dx, key.y + 1)) return true;
  }
  return false;
}

}  // namespace

int NearestBody(const std::vector<Footprint>& bodies, const Return& r, double gate,
                double* excess) {
  int best = -1;
  *excess = gate;
  for (size_t i = 0; i < bodies.size(); ++i) {
    const double e = bodies[i].Excess(r.p.head<2>().cast<double>(), r.age);
    if (e < *excess) *excess = e, best = static_cast<int>(i);
  }
  return best;
}

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

/// Feet that touch cells of the ground belong to what stands in free space above them.
std::vector<MotionDetector::Candidate> MotionDetector::Candidates(
    const std::vector<Return>& returns, VoxelGrid* grid,
    const std::vector<Footprint>& expected) const {
  std::vector<Candidate> candidates;
  std::vector<int> doubtful;     // in occupied cells that are not settled
  std::vector<int64_t> columns;  // with a return in ever-free space
  const auto add = [&](int i, bool strong, bool passed, int body) {
    const Eigen::Vector3f& p = returns[static_cast<size_t>(i)].p;
    const double cell = config_.cluster_cell;
    candidates.push_back(
        {Code(Floor(p.x() / cell), Floor(p.y() / cell)), i, p.z(), strong, passed, body});
  };
  double excess = 0.0;
  for (size_t i = 0; i < returns.size(); ++i) {
    const Return& r = returns[i];
    if (r.label != Label::kStatic) continue;
    const Voxel* voxel = grid->At(r.key);
    const int body = NearestBody(expected, r, config_.gate, &excess);
    // What stands where a body does, and stood there before it, is something else.
    const int stood = body < 0 ? 0 : expected[static_cast<size_t>(body)].stood;
    const bool settled = voxel && voxel->hits >= std::min(255, kSettledHits + stood);
    if (voxel && voxel->occupied && voxel->free_sweeps < ever_free_ && (settled || body < 0)) {
      if (!settled) doubtful.push_back(static_cast<int>(i));
      continue;
    }
    const bool strong = InEverFree(r.key, grid);
    const bool passed =
        strong && r.p.z() - grid->Center(r.key).z() >= grid->step() * voxel->free_down_to;
    add(static_cast<int>(i), strong, passed, body);
    if (strong) columns.push_back(Code(r.key.x, r.key.y));
  }
  std::sort(columns.begin(), columns.end());
  for (const int i : doubtful)
    if (Beside(columns, returns[static_cast<size_t>(i)].key)) add(i, false, false, -1);
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.cell != b.cell ? a.cell < b.cell : a.index < b.index;
  });
  return candidates;
}

/// The connected parts of what is `body`'s, or of what no expected mover explains (-1). Of an
/// expected one half of the returns do that a new one takes. A ring that moves over a table's top
/// lies in free space too, as rays passed above the top: where all is level, returns count that
/// rays passed below. Everywhere this would cost movers half a second until they are found.
std::vector<Cluster> MotionDetector::Connected(const std::vector<Candidate>& candidates,
                                               int body) const {
  struct Bin {
    int64_t cell;
    std::vector<int> members;
    int strong, passed;
    float low, high;
    bool taken;
  };
  std::vector<Bin> bins;
  for (const auto& c : candidates) {
    if (c.body != body) continue;
    if (bins.empty() || bins.back().cell != c.cell)
      bins.push_back({c.cell, {}, 0, 0, c.z, c.z, false});
    Bin& bin = bins.back();
    bin.members.push_back(c.index);
    bin.strong += c.strong || body >= 0;
    bin.passed += c.passed || body >= 0;
    bin.low = std::min(bin.low, c.z);
    bin.high = std::max(bin.high, c.z);
  }
  const auto find = [&](int64_t cell) {
    const auto it = std::lower_bound(bins.begin(), bins.end(), cell,
                                     [](const Bin& bin, int64_t c) { return bin.cell < c; });
    return it != bins.end() && it->cell == cell ? &*it : nullptr;
  };
  std::vector<Cluster> clusters;
  for (auto& start : bins) {
    if (start.taken || start.strong == 0) continue;
    start.taken = true;
    std::vector<Bin*> front{&start};
    Cluster cluster;
    int strong = 0, passed = 0;
    float low = start.low, high = start.high;
    for (size_t head = 0; head < front.size(); ++head) {
      const Bin& at = *front[head];
      strong += at.strong;
      passed += at.passed;
      low = std::min(low, at.low);
      high = std::max(high, at.high);
      cluster.members.insert(cluster.members.end(), at.members.begin(), at.members.end());
      if (at.strong == 0) continue;  // the rim grows no further
      for (int dx = -1; dx <= 1; ++dx)
        for (int dy = -1; dy <= 1; ++dy) {
          Bin* bin = find(at.cell + (static_cast<int64_t>(dx) << 32) + dy);
          if (!bin || bin->taken) continue;
          bin->taken = true;
          front.push_back(bin);
        }
    }
    const auto size = static_cast<int>(cluster.members.size());
    const int seeds = high - low < kLevel ? passed : strong;
    if ((body >= 0 ? 2 : 1) * size >= config_.min_points && seeds >= kFewestSeeds * size)
      clusters.push_back(std::move(cluster));
  }
  return clusters;
}

std::vector<int> MotionDetector::Look(const Eigen::Vector3d& origin, const LowestRays& rays,
                                      const std::vector<Return>& returns,
                                      const std::vector<Cluster>& clusters) {
  std::vector<int> owner(returns.size(), -1);
  for (size_t c = 0; c < clusters.size(); ++c)
    for (const int i : clusters[c].members) owner[static_cast<size_t>(i)] = static_cast<int>(c);
  panorama_.Take(origin, rays, returns, owner);
  return owner;
}

/// Parts of one expected mover belong together where something hides what is between them;
/// otherwise the largest is it, and the others are by themselves. True if any were joined.
bool MotionDetector::Join(const std::vector<Return>& returns,
                          std::vector<Cluster>* clusters) const {
  const auto middle = [&](const Cluster& cluster) {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (const int i : cluster.members) sum += returns[static_cast<size_t>(i)].p;
    return Eigen::Vector3d((sum / static_cast<float>(cluster.members.size())).cast<double>());
  };
  bool joined = false;
  for (size_t i = 0; i < clusters->size(); ++i)
    for (size_t j = 0; j < clusters->size(); ++j) {
      Cluster &whole = (*clusters)[i], &part = (*clusters)[j];
      if (i == j || whole.track < 0 || whole.track != part.track) continue;
      if (whole.members.size() < part.members.size()) continue;
      part.track = -1;
      const Eigen::Vector3d between = 0.5 * (middle(whole) + middle(part));
      if (!panorama_.Hides(between, static_cast<int>(i)) ||
          !panorama_.Hides(between, static_cast<int>(j)))
        continue;
      whole.members.insert(whole.members.end(), part.members.begin(), part.members.end());
      part.members.clear();
      joined = true;
    }
  return joined;
}

/// An end beside which there are returns of something else may belong to more than was found.
void MotionDetector::Touch(const std::vector<Return>& returns, const std::vector<int>& owner,
                           int self, const std::array<Eigen::Vector2f, kDirections>& ends,
                           Cluster* cluster) {
  Eigen::Array2f low = Eigen::Array2f::Constant(1e9f), high = -low;
  for (const auto& end : ends) {
    low = low.min(end.array() - kTouch);
    high = high.max(end.array() + kTouch);
  }
  for (size_t i = 0; i < returns.size(); ++i) {
    const Return& r = returns[i];
    if (r.label == Label::kGround || r.label == Label::kFar || owner[i] == self) continue;
    const Eigen::Vector2f p = r.p.head<2>();
    if ((p.array() < low).any() || (p.array() > high).any()) continue;
    for (size_t k = 0; k < ends.size(); ++k)
      if ((p - ends[k]).squaredNorm() < kTouch * kTouch) cluster->reaches[k].edge = false;
  }
}

/// How far the cluster reaches, and where that is its end. On the side that faces away, of a mover
/// seen from one side only, a thin shell would be tracked as if there were nothing behind: it is
/// supposed to go on a little.
bool MotionDetector::Finish(const std::vector<Return>& returns, const std::vector<int>& owner,
                            int self, Cluster* cluster) const {
  Points2 points;
  float low = INFINITY, high = -INFINITY;
  for (const int i : cluster->members) {
    const auto& p = returns[static_cast<size_t>(i)].p;
    points.push_back(p.head<2>().cast<double>());
    low = std::min(low, p.z());
    high = std::max(high, p.z());
  }
  const Eigen::Vector2d& origin = panorama_.origin();
  std::array<Eigen::Vector2f, kDirections> ends;
  for (int k = 0; k < kDirections; ++k) {
    const Eigen::Vector2d d = Direction(k);
    size_t best = 0;
    for (size_t i = 1; i < points.size(); ++i)
      if (d.dot(points[i]) > d.dot(points[best])) best = i;
    const Return& end = returns[static_cast<size_t>(cluster->members[best])];
    const Eigen::Vector2d view = origin - points[best];
    Reach& reach = cluster->reaches[static_cast<size_t>(k)];
    reach.along = d.dot(points[best]);
    reach.age = end.age;
    reach.edge = d.dot(view) > kGrazing * view.norm() && view.norm() < range_ - kRim &&
                 !panorama_.Hides(end.p.cast<double>(), self);
    ends[static_cast<size_t>(k)] = points[best].cast<float>();
  }
  Touch(returns, owner, self, ends, cluster);
  Rectangle box = SmallestRectangle(ConvexHull(std::move(points)));
  if (2.0 * box.half.x() > config_.max_size) return false;
  const double missing = 2.0 * (kLeastDepth * box.half.x() - box.half.y());
  if (missing > 0.0) {
    Eigen::Vector2d away = box.axes.col(1);
    if (away.dot(box.center - origin) < 0.0) away = -away;
    for (int k = 0; k < kDirections; ++k) {
      Reach& reach = cluster->reaches[static_cast<size_t>(k)];
      if (reach.edge) continue;
      for (const double side : {-1.0, 1.0})
        reach.along = std::max(reach.along,
                               Direction(k).dot(box.center + side * box.half.x() * box.axes.col(0) +
                                                (box.half.y() + missing) * away));
    }
    box.center += 0.5 * missing * away;
  }
  cluster->center << box.center, 0.5 * (low + high);
  cluster->half_height = 0.5 * (high - low);
  return true;
}

std::vector<Cluster> MotionDetector::Detect(const Eigen::Vector3d& origin, const LowestRays& rays,
                                            const std::vector<Return>& returns, VoxelGrid* grid,
                                            const std::vector<Footprint>& expected) {
  const auto candidates = Candidates(returns, grid, expected);
  std::vector<Cluster> clusters;
  for (int body = -1; body < static_cast<int>(expected.size()); ++body)
    for (auto& cluster : Connected(candidates, body)) {
      if (body >= 0) cluster.track = expected[static_cast<size_t>(body)].track;
      clusters.push_back(std::move(cluster));
    }
  auto owner = Look(origin, rays, returns, clusters);
  if (Join(returns, &clusters)) owner = Look(origin, rays, returns, clusters);
  std::vector<Cluster> finished;
  for (size_t c = 0; c < clusters.size(); ++c)
    if (!clusters[c].members.empty() && Finish(returns, owner, static_cast<int>(c), &clusters[c]))
      finished.push_back(std::move(clusters[c]));
  return finished;
}

}  // namespace chase::mapping
