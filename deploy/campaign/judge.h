#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "deploy/campaign/flight_list.h"

namespace chase::campaign {

/// What became of a flight: the first of these that holds.
namespace outcome {
constexpr char kError[] = "error";                 ///< the program failed, or its metrics are bad
constexpr char kCollision[] = "collision";         ///< the drone touched something
constexpr char kOdometryLost[] = "odometry_lost";  ///< a criterion failed and odometry was lost
constexpr char kTargetLost[] = "target_lost";      ///< out of sight or image for too long
constexpr char kOther[] = "other";                 ///< another criterion failed
constexpr char kPassed[] = "passed";
}  // namespace outcome

/// Odometry counts as lost above this RMS error, m: more than half of every gate of the gym (1.48
/// to 1.65 m wide), so that the map shows free space where a pillar stands.
constexpr double kOdometryLost = 1.0;

/// An entry of flights.json: who flew, `outcome`, `why` (empty when passed), then the metrics.
/// `result` is what Fly() left; `duration` [s] is how long was flown, negative: the mission.
/// Criteria that ask for a whole mission or for real time are judged by what was asked for here.
nlohmann::ordered_json Judge(const Flight& flight, const nlohmann::ordered_json& result,
                             double duration);

}  // namespace chase::campaign
