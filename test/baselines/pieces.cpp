#include "test/baselines/pieces.h"

#include <algorithm>

namespace chase::baselines {

Pieces PiecesOf(const planning::PlanResult& plan) {
  Pieces pieces = {plan.trajectory};
  pieces.insert(pieces.end(), plan.rest.begin(), plan.rest.end());
  return pieces;
}

Pieces RunningOf(const planning::PlanRequest& request) {
  if (!request.running) return {};
  Pieces pieces = {*request.running};
  pieces.insert(pieces.end(), request.running_rest.begin(), request.running_rest.end());
  return pieces;
}

void SetPieces(const Pieces& pieces, planning::PlanResult* plan) {
  plan->trajectory = pieces.front();
  plan->rest.assign(pieces.begin() + 1, pieces.end());
}

double EndOf(const Pieces& pieces) { return pieces.back().end(); }

world::State StateAt(const Pieces& pieces, double t) {
  constexpr double kSlack = 1e-9;
  if (t > EndOf(pieces) + kSlack) {
    world::State s;
    s.p = pieces.back().Position(EndOf(pieces));
    return s;
  }
  const auto next = std::find_if(pieces.begin(), pieces.end() - 1, [&](const auto& piece) {
    return t < piece.end() - kSlack;  // at a joint the later piece counts
  });
  return next->At(std::max(t, pieces.front().start));
}

Pieces RestOf(const Pieces& pieces, double t0, double least) {
  Pieces rest;
  if (pieces.empty() || EndOf(pieces) - t0 < least) return rest;
  for (const world::Trajectory& piece : pieces) {
    if (piece.end() <= t0 + 1e-9) continue;
    const double start = std::max(piece.start, t0);
    rest.push_back(start > piece.start ? piece.Reparametrised(start, piece.end() - start) : piece);
  }
  return rest;
}

}  // namespace chase::baselines
