#include "services/perception/belief/decoys.h"

#include <algorithm>

namespace chase::perception {

namespace {

constexpr int kKnownHits = 3;     // sightings that make a look-alike
constexpr double kDriven = 1.2;   // radii from where first seen
constexpr double kMemory = 60.0;  // s that one not seen again is remembered
constexpr size_t kMaxDecoys = 32;

}  // namespace

bool Decoy::known() const { return hits >= kKnownHits; }

bool Decoy::Driven(double radius) const {
  return known() && (p_W - start).norm() > kDriven * radius;
}

const Decoy* Decoys::At(const Eigen::Vector3d& p_W) const {
  for (const Decoy& d : all_)
    if (d.known() && (d.p_W - p_W).norm() < config_.decoy_radius) return &d;
  return nullptr;
}

Decoy* Decoys::Note(const Eigen::Vector3d& p_W, double t, int hits) {
  const auto known = std::find_if(all_.begin(), all_.end(), [&](const Decoy& d) {
    return (d.p_W - p_W).norm() < config_.decoy_radius;
  });
  if (known == all_.end()) {
    if (all_.size() >= kMaxDecoys) return nullptr;
    all_.push_back({p_W, p_W, t, hits});
    return &all_.back();
  }
  known->p_W = p_W;
  known->t = t;
  known->hits += hits;
  return &*known;
}

void Decoys::Forget(double t, const Eigen::Vector3d& p_WT) {
  all_.erase(std::remove_if(all_.begin(), all_.end(),
                            [&](const Decoy& d) {
                              return t - d.t > kMemory ||
                                     (d.p_W - p_WT).norm() < config_.decoy_radius;
                            }),
             all_.end());
}

}  // namespace chase::perception
