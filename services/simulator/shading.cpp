#include "services/simulator/shading.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace chase::simulator {
namespace {

using Eigen::Vector3f;

const Vector3f kSun = Vector3f(0.35f, 0.25f, 0.90f).normalized();
constexpr float kAmbient = 0.45f, kDirect = 0.60f;

/// Floor, without the library call that floor() is on plain x86-64.
int Cell(float x) {
  const int i = static_cast<int>(x);
  return i - (static_cast<float>(i) > x ? 1 : 0);
}

/// A number in [0, 1) that looks random, one for each cell.
float Hash(int x, int y, int z) {
  uint32_t h = static_cast<uint32_t>(x) * 0x8DA6B343u ^ static_cast<uint32_t>(y) * 0xD8163841u ^
               static_cast<uint32_t>(z) * 0xCB1AB31Fu;
  h = (h ^ (h >> 15)) * 0x2C1B3C6Du;
  h = (h ^ (h >> 12)) * 0x297A2D39u;
  return static_cast<float>((h ^ (h >> 15)) >> 8) * 0x1p-24f;
}

float Cells(const Vector3f& p, int salt) {
  return Hash(Cell(p.x()), Cell(p.y()), Cell(p.z()) + salt) - 0.5f;
}

/// Patches of two sizes, in [-1, 1]: so many a metre.
float Patches(const Vector3f& p, float coarse, float fine) {
  return 1.2f * Cells(coarse * p, 0) + 0.8f * Cells(fine * p, 7);
}

/// Courses of blocks on an upright surface.
float Blocks(const Vector3f& p, const Vector3f& n) {
  const float along = std::abs(n.x()) > std::abs(n.y()) ? p.y() : p.x();
  const int course = Cell(4.0f * p.z());
  const float shift = course & 1 ? 0.25f : 0.0f;
  return Hash(Cell(2.0f * (along + shift)), course, 3) - 0.5f;
}

Vector3f Grey(float value, float red, float blue) { return {value * red, value, value * blue}; }

}  // namespace

Vector3f Albedo(Material material, const Vector3f& p, const Vector3f& n,
                const Vector3f& target_color) {
  switch (material) {
    case Material::kNothing:
      return Vector3f::Zero();
    case Material::kGround:
      return Grey(0.42f + 0.10f * Patches({p.x(), p.y(), 0.0f}, 1.11f, 8.33f), 0.97f, 0.85f);
    case Material::kWall:
      return Grey(0.62f + 0.16f * Blocks(p, n), 1.02f, 0.97f);
    case Material::kBox:
      return Grey(0.45f + 0.08f * Patches(p, 2.5f, 12.5f), 0.9f, 1.1f);
    case Material::kPillar:
      return Grey(0.50f + 0.12f * (Cell(2.0f * p.z()) & 1 ? 1.0f : -1.0f), 0.85f, 1.15f);
    case Material::kEllipsoid:
      return Grey(0.45f + 0.08f * Patches(p, 2.0f, 10.0f), 0.8f, 1.2f);
    case Material::kTrunk:
      return Grey(0.26f + 0.10f * Patches(p, 3.33f, 16.7f), 1.10f, 0.85f);
    case Material::kCrown:
      return Grey(0.38f + 0.16f * Patches(p, 2.0f, 6.67f), 0.70f, 0.55f);
    case Material::kMover:
      return Grey(0.40f + 0.06f * Patches(p, 2.0f, 5.0f), 0.55f, 1.60f);
    case Material::kCarrier:
      return Vector3f::Constant(0.12f);
    case Material::kTarget:
      return target_color;
  }
  return Vector3f::Zero();
}

float Lambert(const Vector3f& n) { return kAmbient + kDirect * std::max(0.0f, n.dot(kSun)); }

Vector3f Sky(const Vector3f& direction) {
  const float up = std::clamp(direction.z(), 0.0f, 1.0f);
  return Vector3f(0.80f, 0.86f, 0.92f) - up * Vector3f(0.45f, 0.30f, 0.05f);
}

}  // namespace chase::simulator
