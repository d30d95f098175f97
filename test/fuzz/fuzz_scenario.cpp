// A scenario file, and the world and the target's way that follow from it.
#include "common/world/scenario.h"
#include "test/fuzz/target.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace chase;  // NOLINT(google-build-using-namespace)
  const std::string text(reinterpret_cast<const char*>(data), size);
  fuzz::Accepts([&] {
    const world::Scenario scenario = world::ParseScenario(text, "fuzz");
    world::StaticSolids(scenario);
    for (const auto& mover : scenario.movers) world::MoverAt(mover, 0.5 * scenario.duration_s);
    // A path of its own file is no part of the input.
    if (scenario.target.path_file.empty())
      world::TargetMotion(scenario).Position(0.5 * scenario.duration_s);
  });
  return 0;
}
