#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "common/bus/bus.h"
#include "common/bus/node.h"
#include "common/bus/seal.h"
#include "services/link/link_config.h"
#include "services/link/packet.h"
#include "services/link/peer_socket.h"

namespace chase::link {

/// May a message of this channel (without the vehicle's prefix) leave the vehicle, or the ground?
bool Leaves(const std::string& channel, bool vehicle);

/// Light messages of the bus to the peer, the peer's onto the bus.
class LinkNode : public bus::Node {
 public:
  LinkNode(bus::Bus& bus, const LinkConfig& config);

  int64_t TickPeriod() const override { return 5000; }
  void Tick(int64_t utime) override;
  bus::NodeReport Report() const override;

 private:
  void OnMessage(const std::string& channel, const uint8_t* data, size_t size);
  bool Due(const std::string& channel);
  void TakeIn();
  void SendOut();

  bus::Bus& bus_;
  LinkConfig config_;
  bus::Seal seal_;
  PeerSocket socket_;
  Packer packer_;
  Unpacker unpacker_;
  std::map<std::string, int64_t> sent_;  // when, us
  int64_t last_sent_ = 0, last_heard_ = 0;
  int64_t n_out_ = 0, n_in_ = 0, bytes_out_ = 0, n_refused_ = 0;
};

}  // namespace chase::link
