#include "deploy/worlds/worlds.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>

#include "common/config/changes.h"
#include "deploy/worlds/fairness.h"
#include "deploy/worlds/outfit.h"
#include "deploy/worlds/rounding.h"

namespace chase::worlds {

namespace {

constexpr int kDraws = 200;

const Kind& Find(const std::string& name) {
  for (const Kind& kind : Kinds())
    if (kind.name == name) return kind;
  std::string all;
  for (const Kind& kind : Kinds()) all += (all.empty() ? "" : ", ") + kind.name;
  throw std::invalid_argument(name + ": no such kind of world; use one of " + all);
}

/// A number of its own for each kind and draw.
uint64_t Stream(const Kind& kind, int draw) {
  return static_cast<uint64_t>((&kind - Kinds().data()) * kDraws + draw);
}

void Describe(const Kind& kind, uint64_t seed, const Options& options, world::Scenario* scenario) {
  scenario->name = fmt::format("{}-{}", kind.name, seed);
  scenario->description = kind.sentence;
  if (!options.hidden_start) return;
  scenario->criteria.visible_ratio = 0.7;
  scenario->criteria.in_image_ratio = 0.6;  // it has to be searched first
}

}  // namespace

const std::vector<Kind>& Kinds() {
  static const std::vector<Kind> kinds = {
      {"hall", "A hall with pillars and a few boxes.", Hall},
      {"office", "Rooms with desks and shelves, joined by doors of 1.4 to 2 m.", Office},
      {"corridor", "A corridor of 2.5 to 3.4 m with square turns and cupboards.", Corridor},
      {"forest", "A dense forest on rough ground, at times crossed by large movers.", Forest},
      {"grove", "70 to 130 trees on 56 m x 44 m, on even to rough ground.", Grove},
      {"park", "20 to 60 trees, hedges and benches.", Park},
      {"field", "Ten trees on 60 m x 60 m.", Field},
      {"street", "Two walls 12 m apart, parked cars and lamp posts.", Street},
      {"yard", "Containers, single and two high, and crates.", Yard},
      {"slope", "Trees and boulders on ground that rises by 4 to 12 degrees.", Slope},
      {"crowd", "4 to 8 people who walk, stop and turn back, whatever the drone does.", Crowd},
      {"mixed", "Trees, walls, boxes and pillars, with 2 to 4 people.", Mixed},
  };
  return kinds;
}

world::Scenario MakeWorld(const std::string& name, uint64_t seed, const Options& options) {
  const Kind& kind = Find(name);
  std::string problem;
  for (int draw = 0; draw < kDraws; ++draw) {
    Random random(seed, Stream(kind, draw));
    auto scenario = kind.draw(options, &random);
    if (!scenario) continue;
    const Outfit outfit = DrawOutfit(&random);
    scenario->target.color = DrawColor(&random);
    Describe(kind, seed, options, &*scenario);
    *scenario = Rounded(*scenario, 3);
    problem = Unfairness(*scenario, outfit.simulator.rig, options);
    if (!problem.empty()) continue;
    WriteServices(outfit, LearnTarget(*scenario, outfit, random.Next()), &*scenario);
    return *scenario;
  }
  throw std::runtime_error(
      fmt::format("{} --seed {}: none of {} draws is fair ({}); try another seed", name, seed,
                  kDraws, problem));
}

std::string WorldText(const world::Scenario& scenario) { return config::DumpChanges(scenario); }

}  // namespace chase::worlds
