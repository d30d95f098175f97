#pragma once

#include <Eigen/Core>
#include <vector>

#include "test/baselines/hierarchical/distance_field.h"
#include "test/baselines/hierarchical/parameters.h"

namespace chase::baselines {

/// Cheapest way from `root` through one node of each layer: cells of a grid around the target's
/// point of that layer from which it is seen. Root and nodes; empty when there is no way.
std::vector<Eigen::Vector3d> CheapestViews(const HierarchicalParameters& parameters,
                                           const DistanceField& field, const Eigen::Vector3d& root,
                                           const std::vector<Eigen::Vector3d>& targets,
                                           double layer_time);

}  // namespace chase::baselines
