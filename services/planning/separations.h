#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "common/world/separation.h"
#include "services/planning/problem.h"

namespace chase::planning {

/// What keeps the plan that was asked for last off what is near it: whoever is certain of it asks
/// for its proofs next. About the obstacles of one request.
class SeparationMemory {
 public:
  void Clear() { curve_.resize(0, 3); }
  /// Forgets what is about another curve, or about the same over another time.
  void About(const Curve& curve, const Problem& problem);

  /// What an obstacle was asked: the drone's ball from a tau on, or the line of sight, whose target
  /// has `share` of its radius.
  struct Question {
    int obstacle;  ///< index in the request
    double share;  ///< below 0: of safety
    double radius, from;

    bool operator==(const Question& other) const {
      return obstacle == other.obstacle && share == other.share && radius == other.radius &&
             from == other.from;
    }
  };
  const world::SeparationResult* Find(const Question& question) const;
  void Add(const Question& question, const world::SeparationResult& answer) {
    answers_.emplace_back(question, answer);
  }

 private:
  Curve curve_ = Curve::Zero(0, 3);
  double t0_ = 0.0, duration_ = 0.0;
  std::vector<std::pair<Question, world::SeparationResult>> answers_;
};

/// Where a plan was refused.
struct Refusal {
  int obstacle = -1;  ///< index in the problem's list; -1: nowhere yet
  double tau = -1.0;  ///< instant at which it was touched; -1: not known
};

/// Does the plan stay off the obstacles, and its line of sight from `sight_from` on? Obstacles that
/// stand for no solid are not asked about; where the problem has a reach that holds the plan, nor
/// are those that are not near.
/// `last`, if given, is asked first, and then tells of this plan, because one after the other tends
/// to fail at the same place.
bool StaysOff(const Curve& plan, const Problem& problem, double sight_from, Refusal* last = nullptr,
              SeparationMemory* memory = nullptr);

/// The proofs of that for all obstacles; nothing where it does not: `at` then tells where, if that
/// is one of the list near the plan.
std::optional<std::vector<Proof>> ProveOff(const Curve& plan, const Problem& problem,
                                           double sight_from, SeparationMemory* memory = nullptr,
                                           Refusal* at = nullptr);

/// The drone's ball, and the target's end of the line of sight with its uncertainty; `share` of the
/// latter.
math::Polynomial TargetRadius(const Problem& problem, double share);
world::Ball DroneBall(const Curve& plan, double radius);
world::Ball TargetBall(const Problem& problem, double share);

}  // namespace chase::planning
