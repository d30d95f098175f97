#include "logs/src/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <stdexcept>

#include "common/bus/plan_message.h"
#include "common/logs/log_reader.h"
#include "common/logs/message_types.h"
#include "logs/src/good_message.h"
#include "logs/src/proof_check.h"

namespace chase::logs {
namespace {

constexpr size_t kKept = 100;  // 10 s of OBSTACLES, and of PREDICTION at least

/// The newest messages of a channel.
template <class T>
class Heard {
 public:
  void Take(const T& m) {
    if (kept_.size() == kKept) kept_.pop_front();
    kept_.push_back(m);
  }
  /// The one that the plan was made from; null: it is not in the log.
  const T* Of(const plan_t& plan, const std::string& channel) const {
    const int32_t seq = bus::InputOf(plan, channel);
    const auto at = std::find_if(kept_.rbegin(), kept_.rend(),
                                 [&](const T& m) { return m.seq == seq && m.epoch == plan.epoch; });
    return at == kept_.rend() ? nullptr : &*at;
  }

 private:
  std::deque<T> kept_;
};

class Verifier {
 public:
  Verifier(double hard_radius, double sigmas) : hard_radius_(hard_radius), sigmas_(sigmas) {}
  void Take(const obstacles_t& m) { lists_.Take(m); }
  void Take(const prediction_t& m) { forecasts_.Take(m); }
  void Take(const plan_t& m) {
    ++result_.plans;
    Grounds grounds;
    const bool certified = m.certified_clearance >= 0.0;
    if (certified) {
      AddClaim(m);
      grounds = GroundsOf(m);
      if (!grounds.list) return Leave(m);
    }
    const Examination found = Examine(m, grounds);
    result_.unverified += found.unverified;
    if (!found.fault.empty())
      result_.refuted.push_back(fmt::format("plan {}: {}", m.seq, found.fault));
    else if (found.unverified > 0)
      result_.open.push_back(
          fmt::format("plan {}: {} proofs not verified", m.seq, found.unverified));
    else
      result_.proven += certified;
  }
  const Verification& result() const { return result_; }

 private:
  void Leave(const plan_t& m) {
    ++result_.unheard;
    result_.unverified += m.n_proofs + m.n_stop_proofs;
  }

  void AddClaim(const plan_t& m) {
    const bool first = result_.certified++ == 0;
    result_.hard_radius = first ? m.hard_radius : std::min(result_.hard_radius, m.hard_radius);
    result_.sigmas = first ? m.sigmas : std::min(result_.sigmas, m.sigmas);
    result_.proofs += m.n_proofs + m.n_stop_proofs;
  }

  Grounds GroundsOf(const plan_t& m) const {
    return {lists_.Of(m, "OBSTACLES"), forecasts_.Of(m, "PREDICTION"), hard_radius_, sigmas_};
  }

  Heard<obstacles_t> lists_;
  Heard<prediction_t> forecasts_;
  double hard_radius_, sigmas_;
  Verification result_;
};

}  // namespace

Verification Verify(const std::string& file, double hard_radius, double sigmas) {
  LogReader log(file);
  Verifier verifier(hard_radius, sigmas);
  OneVehicle vehicle(file);
  LogEvent event;
  plan_t plan;
  obstacles_t obstacles;
  prediction_t forecast;
  while (log.Next(&event)) {
    vehicle.Hear(event.channel);
    if (IsOn(event, "OBSTACLES") && DecodeBytes(event.bytes, &obstacles)) verifier.Take(obstacles);
    if (IsOn(event, "PREDICTION") && DecodeBytes(event.bytes, &forecast)) verifier.Take(forecast);
    if (IsOn(event, "PLAN") && DecodeBytes(event.bytes, &plan)) verifier.Take(plan);
  }
  if (verifier.result().plans == 0)
    throw std::runtime_error(file +
                             ": holds no PLAN of ours; see chase-log info, chase-log migrate");
  Verification result = verifier.result();
  result.damage = log.damage();
  return result;
}

std::string Format(const Verification& v) {
  std::string text = fmt::format(
      "{} plans, {} of them certified: {} proven, {} refuted, {} whose OBSTACLES are not in the "
      "log\n"
      "{} proofs, {} of them not verified{}",
      v.plans, v.certified, v.proven, v.refuted.size(), v.unheard, v.proofs, v.unverified,
      v.unverified > 0 ? ": the log lacks what they are about" : "");
  if (v.certified > 0)
    text +=
        fmt::format("; radius {:.3f} m and {:.1f} deviations at least", v.hard_radius, v.sigmas);
  text += "\n";
  for (const Damage& d : v.damage) text += Format(d) + "; what is lost is not verified\n";
  for (const auto* lines : {&v.refuted, &v.open})
    for (const std::string& line : *lines) text += line + "\n";
  return text;
}

}  // namespace chase::logs
