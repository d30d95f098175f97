#pragma once

#include <Eigen/Core>

#include "services/simulator/scene.h"

namespace chase::simulator {

/// Reflectance r g b, 0 to 1, of a surface at p [m, frame W] with unit normal n.
Eigen::Vector3f Albedo(Material material, const Eigen::Vector3f& p, const Eigen::Vector3f& n,
                       const Eigen::Vector3f& target_color);

/// Share of light that a surface with unit normal n sends back: ambient and one sun, Lambert's law.
float Lambert(const Eigen::Vector3f& n);

/// Sky in a unit direction.
Eigen::Vector3f Sky(const Eigen::Vector3f& direction);

}  // namespace chase::simulator
