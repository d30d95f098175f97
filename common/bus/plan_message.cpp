#include "common/bus/plan_message.h"

#include "common/bus/convert.h"

namespace chase::bus {

std::vector<world::Proof> FromMessage(const std::vector<proof_t>& messages) {
  std::vector<world::Proof> proofs(messages.size());
  for (size_t i = 0; i < messages.size(); ++i) {
    const proof_t& m = messages[i];
    world::Proof& proof = proofs[i];
    proof.obstacle = m.obstacle;
    proof.of_sight = m.of == proof_t::SIGHT;
    proof.from = m.from;
    proof.radius = m.radius;
    proof.target_radius = Eigen::Vector2d(m.target_radius[0], m.target_radius[1]);
    for (const separation_t& s : m.separations)
      proof.separations.push_back({s.from, s.to, ToVector(s.normal)});
  }
  return proofs;
}

world::Claim ClaimOf(const plan_t& m, int64_t origin) {
  world::Claim claim;
  claim.position = FromMessage(m.position, origin);
  claim.target = FromMessage(m.target, origin);
  if (m.stop.n_coefficients > 0) claim.stop = FromMessage(m.stop, origin);
  claim.proofs = FromMessage(m.proofs);
  claim.stop_proofs = FromMessage(m.stop_proofs);
  claim.hard_radius = m.hard_radius;
  claim.sigmas = m.sigmas;
  claim.certified = m.certified_clearance >= 0.0;
  claim.last_resort =
      m.verdict == plan_t::BRAKE || m.verdict == plan_t::WAIT || m.verdict == plan_t::MITIGATE;
  claim.starts_inside = claim.last_resort || m.verdict == plan_t::ESCAPE;
  return claim;
}

std::vector<proof_t> ToMessage(const std::vector<world::Proof>& proofs) {
  std::vector<proof_t> out;
  for (const world::Proof& proof : proofs) {
    proof_t m{};
    m.obstacle = proof.obstacle;
    m.of = proof.of_sight ? proof_t::SIGHT : proof_t::SAFETY;
    m.from = proof.from;
    m.radius = proof.radius;
    for (int k = 0; k < 2; ++k) m.target_radius[k] = proof.target_radius[k];
    for (const world::Separation& s : proof.separations) {
      separation_t plane{s.from, s.to, {}};
      Set(plane.normal, s.normal);
      m.separations.push_back(plane);
    }
    m.n_separations = static_cast<int32_t>(m.separations.size());
    out.push_back(m);
  }
  return out;
}

int32_t InputOf(const plan_t& m, const std::string& channel) {
  for (const input_t& input : m.inputs)
    if (input.channel == channel) return input.seq;
  return -1;
}

}  // namespace chase::bus
