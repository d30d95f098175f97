#pragma once

#include <stdint.h>

#include "services/simulator/packets.h"

namespace chase::simulator {

/// Light along eight rays, red, green and blue; 1: white in full light.
struct LightPacket {
  alignas(32) float rgb[3][8];
};

/// Light that comes back along the rays: procedural textures under Lambert's law, or the sky.
void Shade(const RayPacket& rays, const HitPacket& hits, const float target_color[3],
           LightPacket* light);

/// The first `count` pixels as bytes, 3 a pixel; the light times the brightness, cut to 0 to 1.
void Expose(const LightPacket& light, float brightness, int count, uint8_t* out);

/// Share of light that a surface with unit normal x y z sends back: ambient and one sun, Lambert's
/// law.
float Lambert(float x, float y, float z);

}  // namespace chase::simulator
