#include "services/viewer/commander.h"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "common/bus/convert.h"
#include "common/world/ages.h"
#include "common/world/commands.h"

namespace chase::viewer {

Commander::Commander(bus::Bus& bus, std::string token, bool live, Reply reply)
    : bus_(bus), token_(std::move(token)), live_(live), reply_(std::move(reply)) {}

void Commander::Hear(const command_ack_t& ack) {
  for (Given& given : given_) given.call.Hear(ack);
}

std::string Commander::RefusalHere(const Request& request) const {
  std::string refusal = RefusalOf(request, token_);
  if (refusal.empty() && !live_) refusal = "a log is played: nobody flies";
  if (refusal.empty()) refusal = LateRefusal(request);
  const auto own = [&](const Given& g) { return g.request.caller == request.caller; };
  if (refusal.empty() && std::count_if(given_.begin(), given_.end(), own) >= kMost)
    refusal = "too many commands are not answered yet";
  return refusal;
}

std::string Commander::LateRefusal(const Request& request) const {
  const bool rests = request.command == "stop" || request.command == "hold";
  if (!request.utime || rests) return "";
  const double age = bus::Seconds(bus_.Now(), *request.utime);
  if (world::IsFresh(age, kLatest)) return "";
  char words[48];
  std::snprintf(words, sizeof(words), "given %.1f s ago", age);
  return words;
}

void Commander::Take(const Request& request) {
  const std::string refusal = RefusalHere(request);
  if (!refusal.empty()) return Settle(request, refusal, "");
  given_.push_back(
      {request, bus::CommandCall(bus_, *world::CommandNamed(request.command), next_id_++)});
}

void Commander::Turn() {
  std::deque<Given> open;
  for (Given& given : std::exchange(given_, {})) {
    given.call.Turn();
    if (given.call.answered())
      Settle(given.request, given.call.accepted() ? "" : given.call.reason(), given.call.reason());
    else if (given.call.GaveUp())
      Settle(given.request, "no answer; does chase-mission run?", "");
    else
      open.push_back(std::move(given));
  }
  given_ = std::move(open);
}

void Commander::Settle(const Request& request, const std::string& refusal,
                       const std::string& words) {
  ++(refusal.empty() ? taken_ : refused_);
  reply_(request, refusal, words);
}

}  // namespace chase::viewer
