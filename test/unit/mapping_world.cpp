#include "mapping_world.h"

#include <algorithm>
#include <cmath>

namespace chase::mapping::testing {

namespace {

double CastBox(const Box& box, const Eigen::Vector3d& from, const Eigen::Vector3d& direction) {
  const double c = std::cos(box.yaw), s = std::sin(box.yaw);
  const auto turn = [&](const Eigen::Vector3d& v) {
    return Eigen::Vector3d(c * v.x() + s * v.y(), -s * v.x() + c * v.y(), v.z());
  };
  const Eigen::Vector3d o = turn(from - box.center), d = turn(direction);
  double enter = 0.0, leave = INFINITY;
  for (int i = 0; i < 3; ++i) {
    if (std::abs(d[i]) < 1e-12) {
      if (std::abs(o[i]) > box.half[i]) return INFINITY;
      continue;
    }
    const double a = (-box.half[i] - o[i]) / d[i], b = (box.half[i] - o[i]) / d[i];
    enter = std::max(enter, std::min(a, b));
    leave = std::min(leave, std::max(a, b));
  }
  return enter > 0.0 && enter <= leave ? enter : INFINITY;
}

double CastCylinder(const Cylinder& cylinder, const Eigen::Vector3d& from,
                    const Eigen::Vector3d& direction) {
  const Eigen::Vector2d o = from.head<2>() - cylinder.center, d = direction.head<2>();
  const double a = d.squaredNorm(), b = o.dot(d);
  const double c = o.squaredNorm() - cylinder.radius * cylinder.radius;
  const double root = b * b - a * c;
  double best = INFINITY;
  if (root > 0.0 && a > 1e-12) {
    const double s = (-b - std::sqrt(root)) / a;
    const double z = from.z() + s * direction.z();
    if (s > 0.0 && z >= cylinder.bottom && z <= cylinder.top) best = s;
  }
  const double s = (cylinder.top - from.z()) / direction.z();  // lid
  if (s > 0.0 && (o + s * d).squaredNorm() <= cylinder.radius * cylinder.radius)
    best = std::min(best, s);
  return best;
}

}  // namespace

double World::Ground(double x, double y) const {
  const double k = 2.0 * M_PI / wavelength;
  return roughness * std::sin(k * x) * std::cos(0.8 * k * y);
}

double World::Cast(const Eigen::Vector3d& from, const Eigen::Vector3d& direction,
                   int* object) const {
  double best = INFINITY;
  int hit = -1;
  if (direction.z() < -1e-6) {
    const auto above = [&](double s) {
      const Eigen::Vector3d p = from + s * direction;
      return p.z() - Ground(p.x(), p.y());
    };
    // Between the crests' and the troughs' height the ray may meet the ground: march, then bisect.
    double high = std::max(0.0, (roughness - from.z()) / direction.z());
    const double last = std::min(100.0, (-roughness - from.z()) / direction.z());
    double low = high;
    while (above(low) > 0.0 && low < last) high = low, low = std::min(last, low + 0.25);
    for (int i = 0; i < 25 && roughness > 0.0; ++i) {
      const double middle = 0.5 * (low + high);
      (above(middle) > 0.0 ? high : low) = middle;
    }
    if (low > 0.0 && low < 100.0) best = low, hit = 0;
  }
  for (size_t i = 0; i < boxes.size(); ++i) {
    const double s = CastBox(boxes[i], from, direction);
    if (s < best) best = s, hit = 1 + static_cast<int>(i);
  }
  for (size_t i = 0; i < cylinders.size(); ++i) {
    const double s = CastCylinder(cylinders[i], from, direction);
    if (s < best) best = s, hit = 1 + static_cast<int>(boxes.size() + i);
  }
  if (object) *object = hit;
  return best;
}

std::vector<Eigen::Vector2d> GymPillars() {
  return {{2.5, 2.0}, {4.0, 5.8}, {6.0, 3.4}, {7.8, 6.2}, {9.0, 1.9}, {11.0, 4.4}, {12.8, 2.2}};
}

World Gym() {
  World world;
  world.boxes = {{{7.5, -0.1, 2.0}, {7.7, 0.1, 2.0}},
                 {{7.5, 8.1, 2.0}, {7.7, 0.1, 2.0}},
                 {{-0.1, 4.0, 2.0}, {0.1, 4.2, 2.0}},
                 {{15.1, 4.0, 2.0}, {0.1, 4.2, 2.0}}};
  for (const auto& center : GymPillars()) world.cylinders.push_back({center, 0.28, 0.0, 3.0});
  return world;
}

Eigen::Vector3d GymFlight(double t) {
  const double phase = 2.0 * M_PI * t / 50.0;
  return {7.3 - 5.8 * std::cos(phase), 4.3 + 0.9 * std::sin(2.0 * phase) - 0.2,
          1.3 + 0.2 * std::sin(3.0 * phase)};
}

World Forest(double side, int trunks, unsigned seed) {
  World world;
  world.roughness = 0.15;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(0.0, side), radius(0.15, 0.4);
  for (int tries = 0; tries < 100 * trunks; ++tries) {
    if (static_cast<int>(world.cylinders.size()) >= trunks) break;
    Cylinder c{{place(random), place(random)}, radius(random), -1.0, 8.0};
    const bool free = std::all_of(
        world.cylinders.begin(), world.cylinders.end(),
        [&](const auto& o) { return (o.center - c.center).norm() > o.radius + c.radius + 2.5; });
    if (free && std::abs(c.center.y() - 0.5 * side) > 1.2) world.cylinders.push_back(c);
  }
  return world;
}

Sweep Scan(const World& world, const Eigen::Vector3d& at, double t, const SensorNoise& noise,
           std::mt19937* random, Truth* truth, const Eigen::Quaterniond& R_WL) {
  std::normal_distribution<double> normal;
  Sweep sweep;
  sweep.t = t;
  sweep.axis = R_WL * Eigen::Vector3d::UnitZ();
  Eigen::Vector3d error;
  for (int i = 0; i < 3; ++i) error[i] = noise.pose * normal(*random);
  const double yaw = noise.yaw * normal(*random);
  sweep.origin = at + error;
  for (int azimuth = 0; azimuth < 1800; ++azimuth) {
    for (int ring = 0; ring < 16; ++ring) {
      const double a = 2.0 * M_PI * azimuth / 1800.0, e = (2.0 * ring - 15.0) * M_PI / 180.0;
      const Eigen::Vector3d d =
          R_WL * Eigen::Vector3d(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
      int object = -1;
      const double range = world.Cast(at, d, &object);
      if (!(range < 100.0)) continue;
      const Eigen::Vector3d seen = Eigen::AngleAxisd(yaw, Eigen::Vector3d::UnitZ()) * d;
      const double measured = range + noise.range * normal(*random);
      sweep.points.push_back((sweep.origin + measured * seen).cast<float>());
      if (!truth) continue;
      truth->points.push_back(at + range * d);
      truth->objects.push_back(object);
    }
  }
  return sweep;
}

}  // namespace chase::mapping::testing
