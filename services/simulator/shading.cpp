// Compiled for AVX2 on x86, which Embree asks for too (see CMakeLists.txt and Scene). Plain C++ and
// arrays only: anything inline from a header would be compiled for this instruction set and could
// be picked by the linker for everyone.
#include "services/simulator/shading.h"

#include <float.h>
#include <string.h>

#ifdef __AVX2__
#include <immintrin.h>
#endif

namespace chase::simulator {
namespace {

// Eight rays side by side; each lane rounds as a scalar would, whatever the processor.
typedef float V __attribute__((vector_size(32)));
typedef int32_t VI __attribute__((vector_size(32)));
typedef uint32_t VU __attribute__((vector_size(32)));

// (0.35, 0.25, 0.90), normalised.
constexpr float kSun[3] = {0.350878298f, 0.250627369f, 0.902258456f};
constexpr float kAmbient = 0.45f, kDirect = 0.60f;

// Sums of three are a + (b + c).

V Load(const float* p) {
  V v;
  memcpy(&v, p, sizeof v);
  return v;
}

V All(float x) { return V{x, x, x, x, x, x, x, x}; }
V Max(V a, V b) { return a < b ? b : a; }
V Min(V a, V b) { return b < a ? b : a; }
V Abs(V a) { return a < 0.0f ? -a : a; }

V Sqrt(V a) {
#ifdef __AVX2__
  return (V)_mm256_sqrt_ps((__m256)a);
#else
  for (int i = 0; i < 8; ++i) a[i] = __builtin_sqrtf(a[i]);
  return a;
#endif
}

/// Floor.
VI Cell(V x) {
  const VI i = __builtin_convertvector(x, VI);
  return i + (__builtin_convertvector(i, V) > x);  // true is -1
}

/// A number in [0, 1) that looks random, one for each cell.
V Hash(VI x, VI y, VI z) {
  VU h = (VU)x * 0x8DA6B343u ^ (VU)y * 0xD8163841u ^ (VU)z * 0xCB1AB31Fu;
  h = (h ^ (h >> 15)) * 0x2C1B3C6Du;
  h = (h ^ (h >> 12)) * 0x297A2D39u;
  return __builtin_convertvector((VI)((h ^ (h >> 15)) >> 8), V) * 0x1p-24f;
}

/// Where the rays hit, m, and the unit normals there. Frame W.
struct Surface {
  V x, y, z, nx, ny, nz;
};

Surface SurfaceOf(const RayPacket& rays, const HitPacket& hits) {
  const V reach = Load(hits.distance), distance = reach <= FLT_MAX ? reach : All(0.0f);
  const V x = Load(hits.nx), y = Load(hits.ny), z = Load(hits.nz);
  const V squared = x * x + (y * y + z * z);
  const V length = squared > 0.0f ? Sqrt(squared) : All(1.0f);
  return {Load(rays.ox) + distance * Load(rays.dx),
          Load(rays.oy) + distance * Load(rays.dy),
          Load(rays.oz) + distance * Load(rays.dz),
          x / length,
          y / length,
          z / length};
}

/// Lambert's share of light.
V Lit(V nx, V ny, V nz) {
  return kAmbient + kDirect * Max(All(0.0f), nx * kSun[0] + (ny * kSun[1] + nz * kSun[2]));
}

V Cells(const Surface& s, float density, int salt) {
  return Hash(Cell(density * s.x), Cell(density * s.y), Cell(density * s.z) + salt) - 0.5f;
}

/// Grey values at eight points, and the tint that makes a colour of grey.
struct Paint {
  V grey;
  float tint[3];
};

/// Patches of two sizes, so many a metre.
Paint Patches(const Surface& s, float grey, float contrast, float coarse, float fine, float red,
              float blue) {
  return {grey + contrast * (1.2f * Cells(s, coarse, 0) + 0.8f * Cells(s, fine, 7)),
          {red, 1.0f, blue}};
}

/// Courses of blocks on an upright surface.
Paint Blocks(const Surface& s, float grey, float contrast, float red, float blue) {
  const V along = Abs(s.nx) > Abs(s.ny) ? s.y : s.x;
  const VI course = Cell(4.0f * s.z);
  const V shift = (course & 1) != 0 ? All(0.25f) : All(0.0f);
  return {grey + contrast * (Hash(Cell(2.0f * (along + shift)), course, VI{} + 3) - 0.5f),
          {red, 1.0f, blue}};
}

/// Half a metre light, half a metre dark.
Paint Stripes(const Surface& s, float grey, float contrast, float red, float blue) {
  const V sign = (Cell(2.0f * s.z) & 1) != 0 ? All(1.0f) : All(-1.0f);
  return {grey + contrast * sign, {red, 1.0f, blue}};
}

Surface Flattened(Surface s) {
  s.z = All(0.0f);
  return s;
}

Paint PaintOf(Material material, const Surface& s, const float target_color[3]) {
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
      return {All(0.12f), {1.0f, 1.0f, 1.0f}};
    case Material::kTarget:
    case Material::kDecoy:
      return {All(1.0f), {target_color[0], target_color[1], target_color[2]}};
  }
  return Paint{};
}

/// The set of materials that are there, a bit each.
void PaintAll(const Surface& s, VI material, int there, const float target_color[3], V* light) {
  const V lit = Lit(s.nx, s.ny, s.nz);
  for (; there != 0; there &= there - 1) {
    const int m = __builtin_ctz(static_cast<unsigned>(there));
    const Paint paint = PaintOf(static_cast<Material>(m), s, target_color);
    for (int k = 0; k < 3; ++k)
      light[k] = material == m ? lit * (paint.grey * paint.tint[k]) : light[k];
  }
}

/// Lighter towards the horizon.
void Sky(const RayPacket& rays, V* light) {
  constexpr float kHorizon[3] = {0.80f, 0.86f, 0.92f}, kFall[3] = {0.45f, 0.30f, 0.05f};
  const V x = Load(rays.dx), y = Load(rays.dy), z = Load(rays.dz);
  const V up = Min(Max(z / Sqrt(x * x + (y * y + z * z)), All(0.0f)), All(1.0f));
  for (int k = 0; k < 3; ++k) light[k] = kHorizon[k] - up * kFall[k];
}

}  // namespace

float Lambert(float x, float y, float z) { return Lit(All(x), All(y), All(z))[0]; }

/// Paints all eight points with each material that is there, and keeps its own.
void Shade(const RayPacket& rays, const HitPacket& hits, const float target_color[3],
           LightPacket* light) {
  VI material;
  memcpy(&material, hits.material, sizeof material);
  const VI bits = (VI{} + 1) << material;
  int there = 0;
  for (int i = 0; i < 8; ++i) there |= bits[i];
  V sum[3] = {};
  if (there & 1) Sky(rays, sum);
  if (there > 1) PaintAll(SurfaceOf(rays, hits), material, there & ~1, target_color, sum);
  memcpy(light->rgb, sum, sizeof sum);
}

/// The fourth byte of each pixel is left out.
void Expose(const LightPacket& light, float brightness, int count, uint8_t* out) {
  typedef uint8_t Bytes __attribute__((vector_size(16)));
  VI value[3];
  for (int k = 0; k < 3; ++k) {
    const V scaled = 255.0f * (brightness * Load(light.rgb[k])) + 0.5f;
    value[k] = __builtin_convertvector(Min(All(255.0f), Max(All(0.0f), scaled)), VI);
  }
  const VI pixels = value[0] | value[1] << 8 | value[2] << 16;  // least byte first
  Bytes halves[2];
  memcpy(halves, &pixels, sizeof halves);
  for (Bytes& half : halves)
    half =
        __builtin_shufflevector(half, half, 0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, 15, 15, 15, 15);
  uint8_t bytes[24], *to = count == 8 ? out : bytes;
  memcpy(to, &halves[0], 16);
  memcpy(to + 12, &halves[1], 12);
  if (to == bytes) memcpy(out, bytes, static_cast<size_t>(3 * count));
}

}  // namespace chase::simulator
