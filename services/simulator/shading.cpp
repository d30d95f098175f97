#include "services/simulator/shading.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

namespace chase::simulator {
namespace {

using Eigen::Vector3f;

const Vector3f kSun = Vector3f(0.35f, 0.25f, 0.90f).normalized();
constexpr float kFarthest = std::numeric_limits<float>::max();
constexpr float kAmbient = 0.45f, kDirect = 0.60f;

// Loops over eight rays below are plain, so that the compiler turns them into vector instructions.
// Sums of three are a + (b + c).

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

float Cells(float x, float y, float z, int salt) {
  return Hash(Cell(x), Cell(y), Cell(z) + salt) - 0.5f;
}

float Lit(float nx, float ny, float nz, const Vector3f& sun) {
  return kAmbient + kDirect * std::max(0.0f, nx * sun.x() + (ny * sun.y() + nz * sun.z()));
}

/// Where the rays hit, m, the unit normals there, and Lambert's share of light. Frame W.
struct Surface {
  alignas(32) float x[8], y[8], z[8], nx[8], ny[8], nz[8], lit[8];
};

Surface SurfaceOf(const RayPacket& rays, const HitPacket& hits) {
  Surface s;
  for (int i = 0; i < 8; ++i) {
    const float reach = hits.distance[i];
    const float distance = reach <= kFarthest ? reach : 0.0f;
    s.x[i] = rays.ox[i] + distance * rays.dx[i];
    s.y[i] = rays.oy[i] + distance * rays.dy[i];
    s.z[i] = rays.oz[i] + distance * rays.dz[i];
  }
  for (int i = 0; i < 8; ++i) {
    const float x = hits.nx[i], y = hits.ny[i], z = hits.nz[i];
    const float squared = x * x + (y * y + z * z);
    const float length = squared > 0.0f ? std::sqrt(squared) : 1.0f;
    s.nx[i] = x / length, s.ny[i] = y / length, s.nz[i] = z / length;
  }
  const Vector3f sun = kSun;
  for (int i = 0; i < 8; ++i) s.lit[i] = Lit(s.nx[i], s.ny[i], s.nz[i], sun);
  return s;
}

/// Grey values at eight points, and the tint that makes a colour of grey.
struct Paint {
  alignas(32) float grey[8];
  Vector3f tint = Vector3f::Ones();
};

Paint Plain(float grey, const Vector3f& tint) {
  Paint paint;
  std::fill(paint.grey, paint.grey + 8, grey);
  paint.tint = tint;
  return paint;
}

/// Patches of two sizes, so many a metre.
Paint Patches(const Surface& s, float grey, float contrast, float coarse, float fine, float red,
              float blue) {
  Paint paint;
  for (int i = 0; i < 8; ++i)
    paint.grey[i] =
        grey + contrast * (1.2f * Cells(coarse * s.x[i], coarse * s.y[i], coarse * s.z[i], 0) +
                           0.8f * Cells(fine * s.x[i], fine * s.y[i], fine * s.z[i], 7));
  paint.tint = {red, 1.0f, blue};
  return paint;
}

/// Courses of blocks on an upright surface.
Paint Blocks(const Surface& s, float grey, float contrast, float red, float blue) {
  Paint paint;
  for (int i = 0; i < 8; ++i) {
    const float along = std::abs(s.nx[i]) > std::abs(s.ny[i]) ? s.y[i] : s.x[i];
    const int course = Cell(4.0f * s.z[i]);
    const float shift = course & 1 ? 0.25f : 0.0f;
    paint.grey[i] = grey + contrast * (Hash(Cell(2.0f * (along + shift)), course, 3) - 0.5f);
  }
  paint.tint = {red, 1.0f, blue};
  return paint;
}

/// Half a metre light, half a metre dark.
Paint Stripes(const Surface& s, float grey, float contrast, float red, float blue) {
  Paint paint;
  for (int i = 0; i < 8; ++i)
    paint.grey[i] = grey + contrast * (Cell(2.0f * s.z[i]) & 1 ? 1.0f : -1.0f);
  paint.tint = {red, 1.0f, blue};
  return paint;
}

Surface Flattened(Surface s) {
  std::fill(s.z, s.z + 8, 0.0f);
  return s;
}

Paint PaintOf(Material material, const Surface& s, const Vector3f& target_color) {
  switch (material) {
    case Material::kNothing:
      break;
    case Material::kGround:
      return Patches(Flattened(s), 0.42f, 0.10f, 1.11f, 8.33f, 0.97f, 0.85f);
    case Material::kWall:
      return Blocks(s, 0.62f, 0.16f, 1.02f, 0.97f);
    case Material::kBox:
      return Patches(s, 0.45f, 0.08f, 2.5f, 12.5f, 0.9f, 1.1f);
    case Material::kPillar:
      return Stripes(s, 0.50f, 0.12f, 0.85f, 1.15f);
    case Material::kEllipsoid:
      return Patches(s, 0.45f, 0.08f, 2.0f, 10.0f, 0.8f, 1.2f);
    case Material::kTrunk:
      return Patches(s, 0.26f, 0.10f, 3.33f, 16.7f, 1.10f, 0.85f);
    case Material::kCrown:
      return Patches(s, 0.38f, 0.16f, 2.0f, 6.67f, 0.70f, 0.55f);
    case Material::kMover:
      return Patches(s, 0.40f, 0.06f, 2.0f, 5.0f, 0.55f, 1.60f);
    case Material::kCarrier:
      return Plain(0.12f, Vector3f::Ones());
    case Material::kTarget:
      return Plain(1.0f, target_color);
  }
  return Plain(0.0f, Vector3f::Zero());
}

/// Lighter towards the horizon.
void Sky(const RayPacket& rays, LightPacket* light) {
  constexpr float kHorizon[3] = {0.80f, 0.86f, 0.92f}, kFall[3] = {0.45f, 0.30f, 0.05f};
  for (int i = 0; i < 8; ++i) {
    const float x = rays.dx[i], y = rays.dy[i], z = rays.dz[i];
    const float up = std::clamp(z / std::sqrt(x * x + (y * y + z * z)), 0.0f, 1.0f);
    for (int k = 0; k < 3; ++k) light->rgb[k][i] = kHorizon[k] - up * kFall[k];
  }
}

}  // namespace

float Lambert(const Vector3f& n) { return Lit(n.x(), n.y(), n.z(), kSun); }

/// Paints all eight points with each material that is there, and keeps its own.
void Shade(const RayPacket& rays, const HitPacket& hits, const Vector3f& target_color,
           LightPacket* light) {
  uint32_t there = 0;
  for (const Material material : hits.material) there |= 1u << static_cast<int>(material);
  if (there & 1u) Sky(rays, light);
  if (there == 1u) return;
  const Surface s = SurfaceOf(rays, hits);
  for (int m = 1; there >> m != 0; ++m) {
    if (!(there >> m & 1u)) continue;
    const Paint paint = PaintOf(static_cast<Material>(m), s, target_color);
    for (int k = 0; k < 3; ++k)
      for (int i = 0; i < 8; ++i) {
        const float own = s.lit[i] * (paint.grey[i] * paint.tint[k]), other = light->rgb[k][i];
        light->rgb[k][i] = static_cast<int>(hits.material[i]) == m ? own : other;
      }
  }
}

}  // namespace chase::simulator
