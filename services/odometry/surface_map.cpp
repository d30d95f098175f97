#include "services/odometry/surface_map.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace chase::odometry {

namespace {

// A plane must be seen in two directions: the smaller extent is at least this share of the cell and
// well above its thickness. A line is the reverse.
constexpr float kPlaneExtent = 0.20f;
constexpr float kPlaneFlatness = 6.0f;  // variance along over variance across
constexpr float kLineExtent = 0.15f;
constexpr float kLineStraightness = 9.0f;

// As CellKey leaves it free: of the face that is seen from behind a cell's first plane.
constexpr uint64_t kBack = 1ull << 63;
constexpr float kSigmas = 3.0f;

// Floors and walls tend to lie at round distances from the origin. On the border of two cells, each
// would learn the half of the noise that falls into it.
const Eigen::Vector3f kShift(0.382f, 0.427f, 0.464f);

/// How far each of the coordinates u may move without leaving its cell, whatever the rounding of
/// both places: twice two roundings of half an epsilon each, of numbers up to |u| + 1.
float Margin(const Eigen::Vector3f& u) {
  const Eigen::Vector3f inside = u - u.array().floor().matrix();
  const float rounding =
      4.0f * std::numeric_limits<float>::epsilon() * (1.0f + u.cwiseAbs().maxCoeff());
  return std::min(inside.minCoeff(), 1.0f - inside.maxCoeff()) - rounding;
}

}  // namespace

SurfaceMap::SurfaceMap(const MapConfig& config, SurfaceKind kind) : config_(config), kind_(kind) {
  levels_.resize(static_cast<size_t>(config.levels));
  float size = static_cast<float>(config.cell_size);
  for (Level& level : levels_) {
    level.size = size;
    level.inverse_size = 1.0f / size;
    level.shift = size * kShift;
    // All its memory is touched now, so that none has to be found in flight.
    level.moments.resize(static_cast<size_t>(config.max_cells));
    level.fitted.resize(static_cast<size_t>(config.max_cells));
    level.moments.clear();
    level.fitted.clear();
    size *= 2.0f;
  }
}

bool SurfaceMap::Fitted::IsHidden(const Eigen::Vector3f& eye) const {
  const Eigen::Vector3f to_eye = eye - surface.center;
  const float before = surface.direction.dot(to_eye);
  return before < 0.0f && before * before > kSigmas * kSigmas * tilt * tilt * to_eye.squaredNorm();
}

size_t SurfaceMap::Level::FaceOf(uint64_t key, const Eigen::Vector3f& p) {
  bool added = false;
  const size_t cell = static_cast<size_t>(index.FindOrAdd(key, &added));
  if (added) {
    moments.emplace_back().origin = p;
    moments.back().face = key & kBack;
    fitted.emplace_back();
  }
  return cell;
}

size_t SurfaceMap::Level::CellOf(uint64_t key, const Eigen::Vector3f& p,
                                 const Eigen::Vector3f& eye) {
  const size_t cell = FaceOf(key, p);
  const Fitted& front = fitted[cell];
  return front.valid() && front.IsHidden(eye) ? FaceOf(key | kBack, p) : cell;
}

const Surface* SurfaceMap::Level::At(uint64_t key, const Eigen::Vector3f& eye) const {
  for (const uint64_t face : {key, key | kBack}) {
    const int number = index.Find(face);
    if (number == CellIndex::kNone) return nullptr;
    const Fitted& cell = fitted[static_cast<size_t>(number)];
    if (!cell.valid()) return nullptr;
    if (!cell.IsHidden(eye)) return &cell.surface;
  }
  return nullptr;
}

void SurfaceMap::Add(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3f& eye) {
  for (Level& level : levels_) AddTo(points, eye, &level);
}

/// Neighbours along a ring mostly share a cell. A cell that is due for several fits is fitted once,
/// to the points of the last.
void SurfaceMap::AddTo(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3f& eye,
                       Level* level) {
  auto& [keys, cells, due] = scratch_;
  keys.clear(), cells.clear(), due.clear();
  for (const Eigen::Vector3f& p : points) {
    keys.push_back(CellKey(level->Scaled(p)));
    level->index.Prefetch(keys.back());
  }
  for (size_t i = 0; i < points.size(); ++i) {
    if (static_cast<int>(level->moments.size()) >= config_.max_cells) break;
    const bool same = i > 0 && keys[i] == keys[i - 1];
    cells.push_back(same ? cells.back() : level->CellOf(keys[i], points[i], eye));
    __builtin_prefetch(&level->moments[cells.back()]);
  }
  for (size_t i = 0; i < cells.size(); ++i) {
    Moments& moments = level->moments[cells[i]];
    if (moments.n >= config_.max_points) continue;
    moments.Add(points[i]);
    if (moments.n < moments.next_fit) continue;
    moments.next_fit = moments.n + std::max(1, moments.n / 4);
    due.emplace_back(cells[i], moments);
  }
  for (const auto& [cell, moments] : due)
    if (moments.next_fit == level->moments[cell].next_fit)
      level->fitted[cell] = Fit(*level, moments, eye);
}

SurfaceMap::Fitted SurfaceMap::Fit(const Level& level, const Moments& moments,
                                   const Eigen::Vector3f& eye) const {
  const double n = moments.n;
  const Eigen::Vector3d mean = moments.sum.cast<double>() / n;
  const Eigen::Vector3f &s = moments.squares, &p = moments.products;
  Eigen::Matrix3f outer;
  outer << s.x(), p.x(), p.z(), p.x(), s.y(), p.y(), p.z(), p.y(), s.z();
  const Eigen::Matrix3d covariance = outer.cast<double>() / n - mean * mean.transpose();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen;
  eigen.computeDirect(covariance);
  const Eigen::Vector3f lambda = eigen.eigenvalues().cast<float>().cwiseMax(1e-8f);
  const float thickness = static_cast<float>(config_.plane_thickness);
  const float extent = (kind_ == SurfaceKind::kPlane ? kPlaneExtent : kLineExtent) * level.size;
  const Eigen::Vector3f center = moments.origin + mean.cast<float>();
  constexpr float kNone = -1.0f, kAnySide = std::numeric_limits<float>::infinity();
  if (kind_ == SurfaceKind::kPlane) {
    const bool flat = lambda[0] < thickness * thickness && lambda[1] > extent * extent &&
                      lambda[1] > kPlaneFlatness * lambda[0];
    const Eigen::Vector3f normal = eigen.eigenvectors().col(0).cast<float>();
    const float out = normal.dot(eye - center) < 0.0f ? -1.0f : 1.0f;
    const float tilt = std::sqrt(lambda[0] / (lambda[1] * static_cast<float>(moments.n)));
    return {{center, out * normal, lambda[0]}, flat ? tilt : kNone};
  }
  const bool straight = lambda[1] < 2.0f * thickness * thickness && lambda[2] > extent * extent &&
                        lambda[2] > kLineStraightness * lambda[1];
  return {{center, eigen.eigenvectors().col(2).cast<float>(), 0.5f * (lambda[0] + lambda[1])},
          straight ? kAnySide : kNone};
}

const Surface* SurfaceMap::Find(const Eigen::Vector3f& p, const Eigen::Vector3f& eye) const {
  Query query;
  query.p = p;
  Find({&query}, eye);
  return query.surface;
}

void SurfaceMap::Find(std::vector<Query*> queries, const Eigen::Vector3f& eye) const {
  for (Query* query : queries) query->reach = std::numeric_limits<float>::max();
  std::vector<uint64_t> keys;
  for (const Level& level : levels_) {
    keys.clear();
    for (Query* query : queries) {
      const Eigen::Vector3f u = level.Scaled(query->p);
      query->reach = std::min(query->reach, level.size * Margin(u));
      keys.push_back(CellKey(u));
      level.index.Prefetch(keys.back());
    }
    size_t open = 0;
    for (size_t i = 0; i < queries.size(); ++i) {
      queries[i]->surface = level.At(keys[i], eye);
      if (!queries[i]->surface) queries[open++] = queries[i];
    }
    queries.resize(open);
  }
}

void SurfaceMap::Prune(const Eigen::Vector3f& center) {
  for (Level& level : levels_)
    if (10 * level.moments.size() >= 9 * static_cast<size_t>(config_.max_cells))
      PruneLevel(center, &level);
}

/// In place: a map that was full once allocates no more.
void SurfaceMap::PruneLevel(const Eigen::Vector3f& center, Level* level) {
  float range = static_cast<float>(config_.keep_range);
  do {  // a dense world may need a shorter range to make room
    size_t kept = 0;
    for (size_t i = 0; i < level->moments.size(); ++i) {
      if ((level->moments[i].origin - center).squaredNorm() > range * range) continue;
      level->moments[kept] = level->moments[i];
      level->fitted[kept++] = level->fitted[i];
    }
    level->moments.resize(kept);
    level->fitted.resize(kept);
    range *= 0.8f;
  } while (10 * level->moments.size() > 7 * static_cast<size_t>(config_.max_cells) && range > 1.0f);
  level->index.Clear();
  bool added = false;
  for (const Moments& cell : level->moments)
    level->index.FindOrAdd(CellKey(level->Scaled(cell.origin)) | cell.face, &added);
}

void SurfaceMap::Clear() {
  for (Level& level : levels_) {
    level.moments.clear();
    level.fitted.clear();
    level.index.Clear();
  }
}

size_t SurfaceMap::cells() const {
  size_t n = 0;
  for (const Level& level : levels_) n += level.moments.size();
  return n;
}

size_t SurfaceMap::MemoryBytes() const {
  size_t bytes = 0;
  for (const Level& level : levels_)
    bytes += level.index.MemoryBytes() + level.moments.capacity() * sizeof(Moments) +
             level.fitted.capacity() * sizeof(Fitted);
  return bytes;
}

}  // namespace chase::odometry
