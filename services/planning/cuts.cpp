#include "services/planning/cuts.h"

#include <algorithm>
#include <cmath>

namespace chase::planning {
namespace {

using kernels::kSamples;
static_assert(kSamples == CandidateTables::kPadded, "sample_of has a value for every instant");

constexpr double kAsked = 1.03;  // squared distance: a proof has to find room below
constexpr double kFar = 2.0;     // thin shapes passed fast are missed: a proof refuses those plans
constexpr int kSweeps = 24;

// The row's least value and about when: a parabola through the least sample and its neighbours,
// exact for a plan that passes a shape straight.
struct Entry {
  double squared, tau;
};

Entry Deepest(const double* values, double from) {
  Entry entry{HUGE_VAL, 1.0};
  int least = -1;
  for (int k = 0; k < kSamples; ++k)
    if (values[k] < entry.squared && CandidateTables::SampleAt(k) >= from) {
      entry = {values[k], CandidateTables::SampleAt(k)};
      least = k;
    }
  if (least <= 0 || least == kSamples - 1) return entry;
  const double before = values[least - 1], after = values[least + 1];
  const double bend = before - 2.0 * entry.squared + after;
  if (!(bend > 1e-12)) return entry;
  const double offset = std::clamp(0.5 * (before - after) / bend, -1.0, 1.0);
  entry.squared -= 0.5 * bend * offset * offset;
  entry.tau = std::clamp(entry.tau + offset / kSamples, from, 1.0);
  return entry;
}

}  // namespace

void Cuts::Reset(const CandidateTables& tables, const PlanProof& proof, const Points& start,
                 const Points& target) {
  tables_ = &tables;
  proof_ = &proof;
  start_ = start;
  target_ = target;
  n_ = 0;
  kernels::ClearanceInput& in = input_;
  in.free = tables.degree - 3;
  in.n = proof.padded();
  in.rows = static_cast<int>(proof.rows().size());
  in.R = proof.shapes();
  in.center = proof.centers();
  in.sight = proof.asks_sight();
  for (int k = 0; k < kSamples; ++k) in.tau[k] = CandidateTables::SampleAt(k);
  for (int f = 0; f < in.free; ++f)
    std::copy(tables.sample_of[4 + f], tables.sample_of[4 + f] + kSamples, in.phi[f]);
  for (int a = 0; a < 3; ++a) {
    std::fill(in.at[a], in.at[a] + kSamples, 0.0);
    std::fill(in.target[a], in.target[a] + kSamples, 0.0);
    AddAtNodes(tables.sample_of, start, 0, 3, a, in.at[a]);
    AddAtNodes(tables.sample_of, target, 0, tables.degree, a, in.target[a]);
  }
  values_.resize(static_cast<size_t>(in.n * kSamples));
  least_.resize(static_cast<size_t>(in.n));
}

Cuts::Sighting Cuts::At(int row, double tau, const double* x) const {
  const int M = tables_->degree;
  double basis[7] = {};
  for (int i = 0; i <= M; ++i) {
    double b = 1.0;
    for (int k = 0; k < i; ++k) b *= tau * (M - k) / (k + 1);
    for (int k = i; k < M; ++k) b *= 1.0 - tau;
    basis[i] = b;
  }
  double w[3], u[3], R[6];
  for (int i = 0; i < 6; ++i) R[i] = input_.R[i * input_.n + row];
  for (int a = 0; a < 3; ++a) {
    double p = 0.0, q = 0.0;
    for (int i = 0; i < 4; ++i) p += basis[i] * start_(i, a);
    for (int i = 4; i <= M; ++i) p += basis[i] * x[3 * (i - 4) + a];
    for (int i = 0; i <= M; ++i) q += basis[i] * target_(i, a);
    u[a] = q - p;
    w[a] = p - input_.center[a * input_.n + row] - tau * input_.center[(3 + a) * input_.n + row];
  }
  const auto times = [&](const double* v, double* out) {
    out[0] = R[0] * v[0] + R[1] * v[1] + R[2] * v[2];
    out[1] = R[1] * v[0] + R[3] * v[1] + R[4] * v[2];
    out[2] = R[2] * v[0] + R[4] * v[1] + R[5] * v[2];
  };
  double s = 0.0, Rv[3];
  if (input_.sight[row]) {
    double Ru[3];
    times(u, Ru);
    const double uu = u[0] * Ru[0] + u[1] * Ru[1] + u[2] * Ru[2];
    const double wu = w[0] * Ru[0] + w[1] * Ru[1] + w[2] * Ru[2];
    s = std::clamp(-wu / std::max(uu, 1e-12), 0.0, 1.0);
  }
  for (int a = 0; a < 3; ++a) w[a] += s * u[a];
  times(w, Rv);
  Sighting sighting{};
  sighting.squared = w[0] * Rv[0] + w[1] * Rv[1] + w[2] * Rv[2];
  for (int f = 0; f < M - 3; ++f)
    for (int a = 0; a < 3; ++a) sighting.slope[3 * f + a] = 2.0 * (1.0 - s) * basis[4 + f] * Rv[a];
  return sighting;
}

int Cuts::Add(const double* x, const double* base) {
  kernels_->clearance(input_, x, values_.data(), least_.data());
  int added = 0;
  for (int row = 0; row < input_.rows && n_ < kMost; ++row) {
    if (least_[static_cast<size_t>(row)] > kFar) continue;
    const double from = proof_->rows()[static_cast<size_t>(row)].from;
    const Entry entry = Deepest(&values_[static_cast<size_t>(row * kSamples)], from);
    if (!(entry.squared < kAsked)) continue;
    const Sighting s = At(row, entry.tau, base);
    Cut& cut = cuts_[n_];
    double length2 = 0.0;
    cut.b = kAsked - s.squared;
    for (int i = 0; i < 9; ++i) {
      cut.a[i] = s.slope[i];
      if (i < 3 * input_.free) cut.b += s.slope[i] * base[i];
      length2 += s.slope[i] * s.slope[i];
    }
    if (!(length2 > 1e-12)) continue;  // the target's own end: nothing the plan could do
    ++n_;
    ++added;
  }
  return added;
}

void Cuts::Project(const double (*L)[9], const double* inverse, const double* origin,
                   double* y) const {
  const int n = 3 * input_.free;
  double w[kMost][9], b[kMost], length2[kMost], pull[kMost] = {};
  for (int c = 0; c < n_; ++c) {
    b[c] = cuts_[c].b;
    length2[c] = 0.0;
    for (int i = 0; i < n; ++i) {
      double sum = cuts_[c].a[i];
      b[c] -= cuts_[c].a[i] * origin[i];
      for (int k = 0; k < i; ++k) sum -= L[i][k] * w[c][k];
      w[c][i] = sum * inverse[i];
      length2[c] += w[c][i] * w[c][i];
    }
  }
  for (int sweep = 0; sweep < kSweeps; ++sweep) {
    double largest = 0.0;
    for (int c = 0; c < n_; ++c) {
      double short_of = b[c];
      for (int i = 0; i < n; ++i) short_of -= w[c][i] * y[i];
      const double next = std::max(0.0, pull[c] + short_of / length2[c]), change = next - pull[c];
      pull[c] = next;
      for (int i = 0; i < n; ++i) y[i] += change * w[c][i];
      largest = std::max(largest, std::abs(change) * length2[c]);
    }
    if (largest < 1e-5) return;
  }
}

}  // namespace chase::planning
