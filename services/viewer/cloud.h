#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <vector>

namespace chase::viewer {

/// Indices of at most `most` of the points that are spread evenly: the first of each cell of a grid
/// whose edge is the smallest of 0.1 m, 0.14 m, 0.2 m, ... that does. Points that are not finite or
/// farther from the origin than 10 km are left out. Frame W, m.
std::vector<size_t> Thinned(const std::vector<float>& x, const std::vector<float>& y,
                            const std::vector<float>& z, size_t most);

/// These points for the page: byte 1, three bytes of the scene's `generation`, uint32 count,
/// float64 time [s], float64 x y z of `centre`, then int16 x y z per point in centimetres from it;
/// all little endian. Points farther than 327 m from the origin are moved there.
std::string EncodeCloud(double t, int generation, const Eigen::Vector3d& centre,
                        const std::vector<float>& x, const std::vector<float>& y,
                        const std::vector<float>& z, size_t most);

}  // namespace chase::viewer
