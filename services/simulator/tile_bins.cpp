#include "services/simulator/tile_bins.h"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

namespace chase::simulator {

namespace {

using world::Solid;

/// Pixels from the first to the last, both included.
struct Span {
  int first, last;
  bool empty() const { return first > last; }
};

/// Those of `size` whose centres are between two places.
Span PixelsWithin(double from, double to, int size) {
  return {static_cast<int>(std::ceil(std::clamp(from, 0.0, size + 0.0))),
          static_cast<int>(std::floor(std::clamp(to, -1.0, size - 1.0)))};
}

/// The planes through the camera and the image's edges, or a pixel beyond.
class Frustum {
 public:
  Frustum(const world::Rig& rig, const Viewpoint& view) : p_WC_(view.p_WC) {
    const double right = (rig.width_px - rig.center_u_px) / rig.focal_px;
    const double below = (rig.height_px - rig.center_v_px) / rig.focal_px;
    const double left = (rig.center_u_px + 1.0) / rig.focal_px;
    const double above = (rig.center_v_px + 1.0) / rig.focal_px;
    outwards_.col(0) = view.R_WC * Eigen::Vector3d(1.0, 0.0, -right).normalized();
    outwards_.col(1) = view.R_WC * Eigen::Vector3d(-1.0, 0.0, -left).normalized();
    outwards_.col(2) = view.R_WC * Eigen::Vector3d(0.0, 1.0, -below).normalized();
    outwards_.col(3) = view.R_WC * Eigen::Vector3d(0.0, -1.0, -above).normalized();
  }

  /// The ball around the solid is beyond one of the planes.
  bool Misses(const Solid& solid) const {
    const double out = (outwards_.transpose() * (solid.center - p_WC_)).maxCoeff();
    return out > 0.0 && out * out > kSwell * kSwell * solid.half_size.squaredNorm();
  }

 private:
  static constexpr double kSwell = 1.001;  // beyond what is rounded
  Eigen::Vector3d p_WC_;
  Eigen::Matrix<double, 3, 4> outwards_;
};

}  // namespace

void TileBins::Project(const world::Rig& rig, const Viewpoint& view,
                       const std::vector<Solid>& solids) {
  columns_ = (rig.width_px + kColumns - 1) / kColumns;
  rows_ = (rig.height_px + kRows - 1) / kRows;
  ranges_.clear();
  const Frustum frustum(rig, view);
  for (std::size_t i = 0; i < solids.size(); ++i) {
    if (frustum.Misses(solids[i])) continue;
    const Outline outline = OutlineOf(rig, view, solids[i]);
    const Span u = PixelsWithin(outline.box.left, outline.box.right, rig.width_px);
    const Span v = PixelsWithin(outline.box.top, outline.box.bottom, rig.height_px);
    if (outline.box.empty() || u.empty() || v.empty()) continue;
    const NearSolid solid{static_cast<int>(i), static_cast<float>(outline.depth)};
    ranges_.push_back(
        {solid, u.first / kColumns, v.first / kRows, u.last / kColumns, v.last / kRows});
  }
  std::sort(ranges_.begin(), ranges_.end(), [](const Range& a, const Range& b) {
    return std::tie(a.solid.least, a.solid.solid) < std::tie(b.solid.least, b.solid.solid);
  });
  Fill();
}

/// Counts the solids of each tile, and puts them behind those of the tiles before it.
void TileBins::Fill() {
  ends_.assign(static_cast<std::size_t>(columns_ * rows_), 0);
  for (const Range& range : ranges_) ForEachTile(range, [&](int& end) { ++end; });
  int sum = 0;
  for (int& end : ends_) sum += std::exchange(end, sum);
  solids_.resize(static_cast<std::size_t>(sum));
  for (const Range& range : ranges_)
    ForEachTile(range, [&](int& end) { solids_[static_cast<std::size_t>(end++)] = range.solid; });
}

template <class Use>
void TileBins::ForEachTile(const Range& range, Use use) {
  for (int row = range.top; row <= range.bottom; ++row)
    for (int column = range.left; column <= range.right; ++column)
      use(ends_[static_cast<std::size_t>(row * columns_ + column)]);
}

NearSolids TileBins::At(int row, int column) const {
  const auto tile = static_cast<std::size_t>(row / kRows * columns_ + column / kColumns);
  const int first = tile == 0 ? 0 : ends_[tile - 1];
  return {solids_.data() + first, ends_[tile] - first};
}

}  // namespace chase::simulator
