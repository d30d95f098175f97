#pragma once

#include <Eigen/Core>

#include "services/simulator/scene.h"

namespace chase::simulator {

/// Light along eight rays, red, green and blue; 1: white in full light.
struct LightPacket {
  alignas(32) float rgb[3][8];
};

/// Light that comes back along the rays: procedural textures under Lambert's law, or the sky.
void Shade(const RayPacket& rays, const HitPacket& hits, const Eigen::Vector3f& target_color,
           LightPacket* light);

/// Share of light that a surface with unit normal n sends back: ambient and one sun, Lambert's law.
float Lambert(const Eigen::Vector3f& n);

}  // namespace chase::simulator
