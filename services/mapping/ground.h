#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "services/mapping/mapping_config.h"

namespace chase::mapping {

/// Height of the ground in tiles of one metre. A tile follows its lowest returns where they fit to
/// the tiles around it; where none was seen those stand in, then the mean of all.
class GroundModel {
 public:
  explicit GroundModel(const GroundConfig& config);

  /// Learns from a sweep's returns (frame W), seen from `origin`.
  void Update(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3d& origin);
  /// z of the ground at (x, y), m.
  double Height(double x, double y) { return Estimate(TileOf(x), TileOf(y)); }
  /// z of the tile over [x, x + 1) x [y, y + 1), m, where it was seen.
  std::optional<double> Known(int x, int y) const;
  bool IsGround(const Eigen::Vector3f& p) { return p.z() < Height(p.x(), p.y()) + config_.margin; }
  double mean() const { return mean_; }

 private:
  static constexpr int kSide = 128;
  struct Tile {
    int x = INT32_MIN, y = 0;
    bool known = false;
    double z = 0.0;         ///< m
    uint32_t cached = 0;    ///< sweep that `estimate` belongs to
    double estimate = 0.0;  ///< m
    uint32_t sweep = 0;     ///< sweep that the sums belong to
    float low = 0.0f;       ///< lowest return of that sweep
  };
  static int TileOf(double x);
  Tile& At(int x, int y);
  double Estimate(int x, int y);
  double Surroundings(int x, int y);
  void Start(const std::vector<Eigen::Vector3f>& points, const Eigen::Vector3d& origin);

  GroundConfig config_;
  std::vector<Tile> tiles_;
  std::vector<Tile*> seen_;
  uint32_t sweep_ = 1;
  double mean_ = 0.0;
  bool started_ = false;
};

}  // namespace chase::mapping
