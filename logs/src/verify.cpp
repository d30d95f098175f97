#include "logs/src/verify.h"

#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <stdexcept>

#include "common/bus/convert.h"
#include "common/bus/plan_message.h"
#include "common/logs/log_reader.h"
#include "common/logs/message_types.h"

namespace chase::logs {
namespace {

constexpr size_t kLists = 100;  // 10 s: plans name none older than 0.3 s

class Verifier {
 public:
  void Take(const obstacles_t& m) {
    if (lists_.size() == kLists) lists_.pop_front();
    lists_.push_back(m);
  }
  void Take(const plan_t& m) {
    ++result_.plans;
    if (m.certified_clearance < 0.0) return;
    const bool first = result_.certified++ == 0;
    result_.hard_radius = first ? m.hard_radius : std::min(result_.hard_radius, m.hard_radius);
    result_.sigmas = first ? m.sigmas : std::min(result_.sigmas, m.sigmas);
    result_.proofs += m.n_proofs + m.n_stop_proofs;
    const obstacles_t* list = ListOf(m);
    if (!list) {
      ++result_.unheard;
      return;
    }
    std::vector<world::Obstacle> obstacles;
    for (const obstacle_t& o : list->obstacles) obstacles.push_back(bus::FromMessage(o, m.utime));
    const std::string bad = world::Refute(bus::ClaimOf(m, m.utime), {0.0, 0.0, true}, obstacles);
    if (bad.empty())
      ++result_.proven;
    else
      result_.refuted.push_back(fmt::format("plan {}: {}", m.seq, bad));
  }
  const Verification& result() const { return result_; }

 private:
  const obstacles_t* ListOf(const plan_t& m) const {
    const int32_t seq = bus::InputOf(m, "OBSTACLES");
    const auto at = std::find_if(lists_.rbegin(), lists_.rend(), [&](const obstacles_t& list) {
      return list.seq == seq && list.epoch == m.epoch;
    });
    return at == lists_.rend() ? nullptr : &*at;
  }

  std::deque<obstacles_t> lists_;
  Verification result_;
};

}  // namespace

Verification Verify(const std::string& file) {
  LogReader log(file);
  Verifier verifier;
  LogEvent event;
  plan_t plan;
  obstacles_t obstacles;
  while (log.Next(&event)) {
    if (event.channel == "OBSTACLES" && DecodeBytes(event.bytes, &obstacles))
      verifier.Take(obstacles);
    if (event.channel == "PLAN" && DecodeBytes(event.bytes, &plan)) verifier.Take(plan);
  }
  if (verifier.result().plans == 0)
    throw std::runtime_error(file +
                             ": holds no PLAN of ours; see chase-log info, chase-log migrate");
  return verifier.result();
}

std::string Format(const Verification& v) {
  std::string text = fmt::format(
      "{} plans, {} of them certified: {} proven, {} refuted, {} whose OBSTACLES are not in the "
      "log\n"
      "{} proofs; radius {:.3f} m and {:.1f} deviations at least\n",
      v.plans, v.certified, v.proven, v.refuted.size(), v.unheard, v.proofs, v.hard_radius,
      v.sigmas);
  for (const std::string& line : v.refuted) text += line + "\n";
  return text;
}

}  // namespace chase::logs
