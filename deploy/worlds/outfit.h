#pragma once

#include <Eigen/Core>

#include "common/world/scenario.h"
#include "deploy/worlds/draw.h"
#include "services/odometry/odometry_config.h"
#include "services/perception/perception_config.h"
#include "services/planning/planning_config.h"
#include "services/prediction/predictor_config.h"
#include "services/simulator/simulator.h"

namespace chase::worlds {

/// What the drone, its sensors and the light are in truth, and what its user set up.
struct Outfit {
  simulator::SimulatorConfig simulator;
  world::Rig calibrated;  ///< the rig as the services know it
};

/// Mounting, noise, biases, light and what the vehicle is other than control believes.
Outfit DrawOutfit(Random* random);

/// A colour that stands out in the worlds of the simulator: red to yellow, or magenta.
Eigen::Vector3d DrawColor(Random* random);

/// Photos of the target in the open, in the world's light; what perception learns from them and
/// from measuring the target.
perception::PerceptionConfig LearnTarget(const world::Scenario& scenario, const Outfit& outfit,
                                         uint64_t seed);

/// The overrides of all services for this outfit, this look and this world, as a user would write.
void WriteServices(const Outfit& outfit, const perception::PerceptionConfig& learned,
                   world::Scenario* scenario);

}  // namespace chase::worlds
