#include "services/simulator/wind.h"

#include <cmath>

#include "services/simulator/streams.h"

namespace chase::simulator {

Wind::Wind(const world::WindSpec& spec, uint64_t seed) : spec_(spec), random_(seed, kWindStream) {}

void Wind::Step(double dt) {
  if (spec_.gust <= 0.0) return;
  const double keep = std::exp(-dt / spec_.gust_time);
  const double spread = spec_.gust * std::sqrt(1.0 - keep * keep);
  for (int i = 0; i < 3; ++i)
    gust_[i] = keep * gust_[i] + (i == 2 ? 0.5 : 1.0) * spread * random_.Gaussian();
}

}  // namespace chase::simulator
