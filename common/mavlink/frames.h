#pragma once

#include <Eigen/Geometry>

/// Our frames and PX4's, in one place. World: W (x east, y north, z up) and NED; PX4 calls the
/// latter LOCAL_FRD where its x axis need not point north, as ours does not. Body: B (x forward,
/// y left, z up) and FRD (x forward, y right, z down). Each map is its own inverse.
namespace chase::mavlink {

/// Of a vector in W the same in NED, and back.
Eigen::Vector3d SwapWorld(const Eigen::Vector3d& v);

/// Of a vector in B the same in FRD, and back.
Eigen::Vector3d SwapBody(const Eigen::Vector3d& v);

/// Of R_WB the rotation from FRD to NED, and back.
Eigen::Quaterniond SwapFrames(const Eigen::Quaterniond& R);

/// The matrices of the two maps; both are rotations by half a turn.
Eigen::Matrix3d WorldSwap();
Eigen::Matrix3d BodySwap();

}  // namespace chase::mavlink
