#pragma once

#include <string>

namespace chase::link {

struct LinkConfig {
  std::string side = "vehicle";
  int port = 7700;
  std::string peer;
  std::string key_file;
  double most_rate_hz = 0.0;

  template <class V>
  void Visit(V& v) {
    v("side", side, "vehicle: sends all light messages, takes commands; ground: the other way");
    v("port", port, "UDP port of this side");
    v("peer", peer,
      "the other side, ADDRESS:PORT; empty: the last that knows the key, or without one nobody");
    v("key_file", key_file, "64 hexadecimal digits that both sides share; empty: no seal");
    v("most_rate_hz", most_rate_hz, "of any channel, for a slow radio; 0: every message");
  }

  bool is_vehicle() const { return side == "vehicle"; }
  /// Names the field, its value and the limit; empty when all is well.
  std::string Problem() const;
};

}  // namespace chase::link
