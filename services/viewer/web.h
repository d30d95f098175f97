#pragma once

#include <array>
#include <atomic>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/steady_timer.hpp>
#include <map>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <thread>
#include <vector>

#include "services/viewer/outbox.h"
#include "services/viewer/server.h"

namespace chase::viewer {

/// One WebSocket connection, in the server's thread only.
class Client {
 public:
  virtual ~Client() = default;
  virtual void OfferPart(Part part, const Frame& frame) = 0;
  virtual void OfferChannels(const std::string& advertisement) = 0;
  virtual void OfferMessage(uint32_t channel, int64_t utime, const std::string& payload) = 0;
  /// To a command, for who gave it; what the vehicle has taken also for all pages.
  virtual void OfferAnswer(const Request& request, const std::string& refusal,
                           const std::string& words) = 0;
  virtual bool Wants(Part part) const = 0;
  /// Sets true what it has subscribed to.
  virtual void MarkSubscribed(std::array<bool, Server::kMostChannels>* channels) const = 0;
  virtual bool IsPage() const = 0;
};

/// What the connections share. Everything but the atomics and the inbox belongs to the server's
/// thread.
struct Server::Hub {
  Hub(const ServerConfig& server_config, Assets page_assets)
      : config(server_config), assets(std::move(page_assets)), acceptor(io), pause(io) {}

  /// After clients came, went or asked for something else.
  void Recount();
  /// Of more than kMostRequests of one client between two ticks the first are heard.
  void Ask(const Request& request);

  ServerConfig config;
  Assets assets;
  std::set<Client*> clients;
  std::map<Part, Frame> retained;
  std::vector<FoxgloveChannel> channels;
  uint64_t last_client = 0;  ///< number of the newest
  int port = 0;              ///< that is listened on
  std::string session;       ///< tells Foxglove one start of the server from the next

  std::mutex inbox_mutex;
  std::vector<Request> inbox;
  std::map<uint64_t, int> asked;  ///< how many of a client's requests are in the inbox
  std::atomic<int> connected{0};  ///< HTTP and WebSocket
  std::atomic<int> sockets{0};    ///< of them WebSocket
  std::atomic<int> pages{0}, pending{0};
  std::atomic<bool> wants_cloud{false}, wants_image{false};
  std::array<std::atomic<bool>, kMostChannels> subscribed{};
  std::atomic<int64_t> accepted{0}, refused{0}, malformed{0}, dropped{0}, unheard{0};

  boost::asio::io_context io{1};  // goes first: its handlers know what stands above
  boost::asio::ip::tcp::acceptor acceptor;
  boost::asio::steady_timer pause;
  std::thread thread;
};

/// Serves one connection until it ends.
void ServeConnection(boost::asio::ip::tcp::socket socket, Server::Hub& hub);

}  // namespace chase::viewer
