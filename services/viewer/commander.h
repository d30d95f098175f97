#pragma once

#include <deque>
#include <functional>
#include <string>

#include "common/bus/command_call.h"
#include "services/viewer/request.h"

namespace chase::viewer {

/// Gives the vehicle what pages and Foxglove command with the right token, each command until it is
/// answered.
class Commander {
 public:
  /// `reply(request, refusal, words)` is called once for each command; refusal: empty where the
  /// vehicle has taken it. `token`: empty: all are refused. `live`: false: all are refused.
  using Reply = std::function<void(const Request&, const std::string&, const std::string& words)>;
  Commander(bus::Bus& bus, std::string token, bool live, Reply reply);

  void Take(const Request& request);
  /// Of all acknowledgements.
  void Hear(const command_ack_t& ack);
  /// Sends what is due and answers what is over: ten times a second.
  void Turn();

  int64_t taken() const { return taken_; }      ///< by the vehicle
  int64_t refused() const { return refused_; }  ///< by the vehicle or here

 private:
  struct Given {
    Request request;
    bus::CommandCall call;
  };
  static constexpr int kMost = 8;  // a client's under way: a finger is no faster than their answers
  static constexpr double kLatest = 2.0;  // s; a link that is slower is none to command by
  std::string RefusalHere(const Request& request) const;
  /// Of what waited in a link that stalled: a page gives a command at the time of its newest state.
  /// What brings the vehicle to rest is never late.
  std::string LateRefusal(const Request& request) const;
  void Settle(const Request& request, const std::string& refusal, const std::string& words);

  bus::Bus& bus_;
  std::string token_;
  bool live_;
  Reply reply_;
  std::deque<Given> given_;
  int64_t next_id_ = 1, taken_ = 0, refused_ = 0;
};

}  // namespace chase::viewer
