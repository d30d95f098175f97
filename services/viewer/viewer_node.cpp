#include "services/viewer/viewer_node.h"

#include <type_traits>

#include "common/config/version.h"
#include "services/viewer/shown_channels.h"

namespace chase::viewer {
namespace {

ServerConfig ServerConfigOf(const ViewerConfig& config, const std::string& source) {
  ServerConfig out;
  out.address = config.address;
  out.port = config.port;
  out.max_clients = config.max_clients;
  out.commands = !config.token.empty() && source.empty();
  out.parameters = {{"version", config::Version()},
                    {"source", source.empty() ? "live" : source},
                    {"cloud_points", std::to_string(config.cloud_points)},
                    {"max_clients", std::to_string(config.max_clients)}};
  return out;
}

}  // namespace

ViewerNode::ViewerNode(bus::Bus& bus, const ViewerConfig& config, const std::string& source)
    : server_(ServerConfigOf(config, source), LoadAssets(AssetFolder())),
      foxglove_(server_, config.rig),
      feed_(bus, server_, config, source),
      commander_(bus, config.token, source.empty(),
                 [this](const auto&... answer) { server_.Answer(answer...); }) {
  const auto hear = [this](const char* channel, const auto& m) {
    if (IsOnPage(channel)) feed_.Take(m);
    if constexpr (std::is_same_v<std::decay_t<decltype(m)>, command_ack_t>) commander_.Hear(m);
    foxglove_.Offer(channel, m);
  };
  SubscribeShown(bus, hear);
  if (!source.empty()) SubscribeUnknown(bus, hear);
}

void ViewerNode::Tick(int64_t utime) {
  const std::vector<Request> requests = server_.TakeRequests();
  for (const Request& request : requests)
    if (!request.command.empty()) commander_.Take(request);
  if (on_play_) on_play_(requests);
  commander_.Turn();
  const Server::Counters c = server_.counters();
  feed_.Tick(utime, std::to_string(c.connected) + " connected, " + std::to_string(c.refused) +
                        " refused, " + std::to_string(c.dropped) + " frames and " +
                        std::to_string(c.unheard) + " requests dropped");
}

bus::NodeReport ViewerNode::Report() const {
  const Server::Counters c = server_.counters();
  return {bus::NodeReport::State::kOk,
          "port " + std::to_string(server_.port()) + ", " + std::to_string(c.connected) +
              " connected, " + std::to_string(c.refused) + " refused, " +
              std::to_string(c.malformed) + " malformed, " + std::to_string(c.unheard) +
              " requests dropped, " + std::to_string(commander_.taken()) + " commands taken, " +
              std::to_string(commander_.refused()) + " refused"};
}

}  // namespace chase::viewer
