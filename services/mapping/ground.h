#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "services/mapping/mapping_config.h"

namespace chase::mapping {

/// Height of the ground in tiles of one metre that lean as the ground around the sensor does. A
/// tile follows its lowest returns where they fit to the tiles around it; where none was seen those
/// stand in, then the plane through all.
class GroundModel {
 public:
  explicit GroundModel(const GroundConfig& config);

  /// Learns from a sweep's returns (frame W), seen from `origin`.
  void Update(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3d& origin);
  /// z of the ground at (x, y), m.
  double Height(double x, double y) {
    const Tile& tile = At(TileOf(x), TileOf(y));
    return tile.estimate + Rise(tile, x, y);
  }
  /// z of the tile over [x, x + 1) x [y, y + 1), m, where it was seen.
  std::optional<double> Known(int x, int y) const;
  bool IsGround(const Eigen::Vector3f& p) { return p.z() < Height(p.x(), p.y()) + config_.margin; }
  /// z of the plane through the ground around at (x, y), m.
  double Plain(double x, double y) const { return plane_.Height(x, y); }

 private:
  static constexpr int kSide = 128;
  struct Tile {
    int x = INT32_MIN, y = 0;
    bool known = false;
    double z = 0.0;                                 ///< m, in the middle
    uint32_t cached = 0;                            ///< sweep that the next two belong to
    double estimate = 0.0;                          ///< m, in the middle
    double surroundings = 0.0;                      ///< m, likewise, without the tile itself
    uint32_t sweep = 0;                             ///< sweep that `low` belongs to
    Eigen::Vector3d low = Eigen::Vector3d::Zero();  ///< lowest return of that sweep, m
  };
  /// z = slope (x, y) + z0, m.
  struct Plane {
    Eigen::Vector2d slope = Eigen::Vector2d::Zero();
    double z0 = 0.0;
    double Height(double x, double y) const { return slope.x() * x + slope.y() * y + z0; }
  };
  static int TileOf(double x);
  static size_t IndexOf(int x, int y);
  Tile& Place(int x, int y);
  /// With its estimates as they are in this sweep.
  Tile& At(int x, int y);
  const Tile* Seen(int x, int y) const;
  double Surroundings(const Tile& tile) const;
  /// From the middle of the tile to (x, y).
  double Rise(const Tile& tile, double x, double y) const {
    return plane_.Height(x, y) - plane_.Height(tile.x + 0.5, tile.y + 0.5);
  }
  void FollowPlane(const Eigen::Vector3d& origin);

  GroundConfig config_;
  std::vector<Tile> tiles_;
  std::vector<Tile*> seen_;
  uint32_t sweep_ = 1;
  Plane plane_;
  bool started_ = false;
};

}  // namespace chase::mapping
