#pragma once

#include <vector>

#include "common/world/rig.h"
#include "common/world/shapes.h"
#include "services/simulator/facets.h"
#include "services/simulator/projection.h"

namespace chase::simulator {

/// Which solids the rays of each tile of an image may meet, from the solids' projections.
class TileBins {
 public:
  static constexpr int kColumns = 8, kRows = 4;  ///< pixels of a tile

  /// Solids in frame W; their numbers in the bins are their places in the list.
  void Project(const world::Rig& rig, const Viewpoint& view,
               const std::vector<world::Solid>& solids);

  /// Of the tile that holds a pixel; the nearest first. Distances in multiples of the optical axis.
  NearSolids At(int row, int column) const;

 private:
  /// Tiles from the first to the last, both included.
  struct Range {
    NearSolid solid;
    int left, top, right, bottom;
  };
  void Fill();
  template <class Use>
  void ForEachTile(const Range& range, Use use);

  int columns_ = 0, rows_ = 0;  // of tiles
  std::vector<Range> ranges_;
  std::vector<int> ends_;  // of each tile's solids
  std::vector<NearSolid> solids_;
};

}  // namespace chase::simulator
