#include "logs/src/identification.h"

#include "logs/src/fits.h"

namespace chase::logs {

std::optional<Identification> Identify(const FlightSamples& samples) {
  const SettledFlight flight(samples);
  if (!flight.Suffices()) return std::nullopt;
  Identification result;
  result.seconds = flight.seconds();
  result.speeds = flight.Speeds();
  const Eigen::Vector3d wind = FindDrag(flight, &result);
  FindThrust(flight, wind, &result);
  FindAttitude(flight, &result);
  return result;
}

}  // namespace chase::logs
