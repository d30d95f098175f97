#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "common/world/random.h"
#include "services/simulator/tile_bins.h"

namespace chase::simulator {
namespace {

using Eigen::Vector3d;
using world::Solid;

constexpr double kFar = 200.0;  // m

Vector3d Uniform(world::Random* random, double most) {
  return {random->Uniform(-most, most), random->Uniform(-most, most), random->Uniform(-most, most)};
}

/// Solids of all kinds and sizes all around the origin, some of them at the camera.
std::vector<Solid> Scattered(world::Random* random) {
  std::vector<Solid> solids;
  for (int i = 0; i < 60; ++i) {
    const auto kind = static_cast<Solid::Kind>(i % 3);
    const double size = i % 5 == 0 ? 6.0 : 0.8;
    Vector3d half(random->Uniform(0.02, size), random->Uniform(0.02, size),
                  random->Uniform(0.02, size));
    if (kind == Solid::Kind::kCylinder) half.y() = half.x();
    solids.push_back({kind, Uniform(random, 12.0), half, random->Uniform(-3.0, 3.0)});
  }
  return solids;
}

Viewpoint RandomView(world::Random* random) {
  const Eigen::AngleAxisd turn(random->Uniform(-3.0, 3.0), Uniform(random, 1.0).normalized());
  return {Uniform(random, 2.0), turn.toRotationMatrix()};
}

/// Every solid that a pixel sees is in the bin of its tile, no nearer than the bin says. Returns
/// the share of those in the bins that their tiles' pixels see.
double ExpectBinsToHold(uint64_t seed) {
  world::Random random(seed);
  const world::Rig rig;
  TileBins bins;
  long seen = 0, held = 0;
  for (int view_index = 0; view_index < 20; ++view_index) {
    const auto solids = Scattered(&random);
    const Viewpoint view = RandomView(&random);
    bins.Project(rig, view, solids);
    for (int i = 0; i < 300; ++i) {
      const int row = static_cast<int>(random.Next() % static_cast<unsigned>(rig.height_px));
      const int column = static_cast<int>(random.Next() % static_cast<unsigned>(rig.width_px));
      const Vector3d d = view.R_WC * Vector3d((column - rig.center_u_px) / rig.focal_px,
                                              (row - rig.center_v_px) / rig.focal_px, 1.0);
      const NearSolids near = bins.At(row, column);
      std::vector<double> least(solids.size(), INFINITY);
      for (int k = 0; k < near.count; ++k) {
        least[static_cast<std::size_t>(near.first[k].solid)] = near.first[k].least;
        EXPECT_TRUE(k == 0 || near.first[k - 1].least <= near.first[k].least);
      }
      held += near.count;
      for (std::size_t k = 0; k < solids.size(); ++k) {
        if (!world::SegmentHits(solids[k], view.p_WC, view.p_WC + kFar * d)) continue;
        ++seen;
        EXPECT_LT(least[k], kFar) << "seed " << seed << " view " << view_index << " solid " << k;
        EXPECT_TRUE(least[k] == 0.0 ||
                    !world::SegmentHits(solids[k], view.p_WC, view.p_WC + 0.999 * least[k] * d));
      }
    }
  }
  return static_cast<double>(seen) / static_cast<double>(held);
}

TEST(TileBins, HoldWhatThePixelsSee) {
  for (uint64_t seed = 1; seed <= 3; ++seed) EXPECT_GT(ExpectBinsToHold(seed), 0.5);
}

TEST(TileBins, NothingBehindTheCameraIsInThem) {
  TileBins bins;
  const world::Rig rig;
  bins.Project(rig, {}, {{Solid::Kind::kBox, {0.0, 0.0, -3.0}, {1.0, 1.0, 1.0}, 0.3}});
  for (int row = 0; row < rig.height_px; row += TileBins::kRows)
    for (int column = 0; column < rig.width_px; column += TileBins::kColumns)
      EXPECT_EQ(bins.At(row, column).count, 0);
}

}  // namespace
}  // namespace chase::simulator
