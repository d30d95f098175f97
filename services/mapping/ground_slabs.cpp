#include "services/mapping/ground_slabs.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace chase::mapping {

namespace {

constexpr int kLargest = 16, kSmallest = 4;  // m, sides of a slab; powers of two
constexpr int kFirstId = 1 << 28;            // between those of pieces and of tracks
constexpr int kPlaces = 64;                  // a side, after which ids come again
constexpr double kOverlap = 0.5;             // m, beyond its place
// Each slope is zero to this deviation where few tiles tell it, against that of a tile's height.
constexpr double kSlope = 0.3, kTile = 0.05;

struct Plane {
  Eigen::Vector2d slope = Eigen::Vector2d::Zero();
  Eigen::Vector3d through = Eigen::Vector3d::Zero();
  double above = 0.0;  ///< most that a tile lies above it, m
};

class Slabs {
 public:
  Slabs(const GroundModel& ground, const Eigen::Vector3d& origin, double radius, double height)
      : ground_(ground), origin_(origin.head<2>()), radius_(radius), height_(height) {}

  void Add(int x, int y, int side) {
    const Eigen::Vector2d middle(x + 0.5 * side, y + 0.5 * side);
    const Eigen::Vector2d beyond =
        ((middle - origin_).cwiseAbs().array() - 0.5 * side).max(0.0).matrix();
    if (beyond.norm() > radius_) return;
    tiles_.clear();
    for (int i = x; i < x + side; ++i)
      for (int j = y; j < y + side; ++j)
        if (const auto z = ground_.Known(i, j)) tiles_.emplace_back(i + 0.5, j + 0.5, *z);
    if (tiles_.empty()) return;
    const Plane plane = Fit();
    if (plane.above <= 0.5 * height_ || side == kSmallest) return AddSlab(plane, middle, side);
    const int half = side / 2;
    for (int i = 0; i < 4; ++i) Add(x + i / 2 * half, y + i % 2 * half, half);
  }

  std::vector<world::Obstacle> Take(double t, double duration) {
    for (auto& slab : slabs_)
      slab.center = world::Trajectory::Constant(slab.center.Position(0.0), t, duration);
    return std::move(slabs_);
  }

 private:
  Plane Fit() const {
    Plane plane;
    for (const auto& p : tiles_) plane.through += p / static_cast<double>(tiles_.size());
    Eigen::Matrix2d A = kTile * kTile / (kSlope * kSlope) * Eigen::Matrix2d::Identity();
    Eigen::Vector2d b = Eigen::Vector2d::Zero();
    for (const auto& p : tiles_) {
      const Eigen::Vector3d d = p - plane.through;
      A += d.head<2>() * d.head<2>().transpose();
      b += d.z() * d.head<2>();
    }
    plane.slope = A.ldlt().solve(b);
    for (const auto& p : tiles_) {
      const Eigen::Vector3d d = p - plane.through;
      plane.above = std::max(plane.above, d.z() - plane.slope.dot(d.head<2>()));
    }
    return plane;
  }

  void AddSlab(const Plane& plane, const Eigen::Vector2d& middle, int side) {
    const Eigen::Vector3d normal(-plane.slope.x(), -plane.slope.y(), 1.0);
    world::Obstacle o;
    const auto place = [&](double at) {
      return static_cast<int>(std::floor(at / kSmallest)) & (kPlaces - 1);
    };
    o.id =
        kFirstId + ((side / kSmallest) * kPlaces + place(middle.x())) * kPlaces + place(middle.y());
    o.ground = true;
    o.solid = world::Obstacle::Solid::kBox;
    o.axes = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), normal);
    const double across = 0.5 * side * normal.norm() + kOverlap;
    o.half = {across, across, height_ / normal.norm()};
    Eigen::Vector3d center;
    center << middle,
        plane.through.z() + plane.above + plane.slope.dot(middle - plane.through.head<2>());
    o.center = world::Trajectory::Constant(center, 0.0, 1.0);
    const Eigen::Matrix3d R = o.axes.toRotationMatrix();
    o.shape = R * (3.0 * o.half.cwiseAbs2()).cwiseInverse().asDiagonal() * R.transpose();
    slabs_.push_back(o);
  }

  const GroundModel& ground_;
  const Eigen::Vector2d origin_;
  const double radius_, height_;
  std::vector<Eigen::Vector3d> tiles_;
  std::vector<world::Obstacle> slabs_;
};

int First(double at) { return static_cast<int>(std::floor(at / kLargest)) * kLargest; }

}  // namespace

std::vector<world::Obstacle> GroundSlabs(const GroundModel& ground, const Eigen::Vector3d& origin,
                                         double radius, double height, double t, double duration) {
  Slabs slabs(ground, origin, radius, height);
  for (int x = First(origin.x() - radius); x <= First(origin.x() + radius); x += kLargest)
    for (int y = First(origin.y() - radius); y <= First(origin.y() + radius); y += kLargest)
      slabs.Add(x, y, kLargest);
  return slabs.Take(t, duration);
}

}  // namespace chase::mapping
