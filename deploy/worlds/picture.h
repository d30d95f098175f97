#pragma once

#include <cstdint>
#include <string>

#include "common/world/scenario.h"
#include "deploy/worlds/kinds.h"

namespace chase::worlds {

/// The world from above as a PNG: what stands, the target's way in its colour, its stops, movers'
/// ways in blue, the chaser's start. Throws std::runtime_error when the file cannot be written.
void SavePicture(const world::Scenario& scenario, const std::string& file);

/// One world of each kind in a table of four columns.
void SaveMontage(uint64_t seed, const Options& options, const std::string& file);

}  // namespace chase::worlds
