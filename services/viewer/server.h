#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "services/viewer/assets.h"
#include "services/viewer/foxglove_protocol.h"
#include "services/viewer/page_sink.h"
#include "services/viewer/request.h"

namespace chase::viewer {

struct ServerConfig {
  std::string address = "127.0.0.1";
  int port = 0;           ///< 0: any free one
  int max_clients = 64;   ///< connections at a time; more are closed at once
  Parameters parameters;  ///< that Foxglove may read
  bool commands = false;  ///< Foxglove is offered the service that gives commands
};

/// HTTP and WebSocket server with a thread of its own: the page's files, the page's data at /ws,
/// and Foxglove's protocol for clients that ask for it. Its functions may be called from another
/// thread and do not wait for any client.
class Server : public PageSink {
 public:
  /// Throws std::runtime_error, one line with the cure, when the address cannot be listened on.
  Server(const ServerConfig& config, Assets assets);
  ~Server() override;
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  int port() const;

  void Send(Part part, std::string bytes, bool binary) override;
  void Retain(Part part, std::string bytes) override;
  bool Wanted(Part part) const override;
  int pages() const;
  /// What clients asked for since the last call; of more than kMostRequests of one client the
  /// first.
  static constexpr int kMostRequests = 16;  ///< a scrubber asks six times between two ticks
  std::vector<Request> TakeRequests();
  /// To a command: to who gave it; what the vehicle has taken also to all pages. As ReplyText has
  /// it.
  void Answer(const Request& request, const std::string& refusal, const std::string& words);

  /// A channel for Foxglove; ids count from 1 and stay below kMostChannels.
  static constexpr uint32_t kMostChannels = 256;
  void Advertise(const FoxgloveChannel& channel);
  bool Subscribed(uint32_t channel) const;
  void SendMessage(uint32_t channel, int64_t utime, std::string payload);

  struct Counters {
    int64_t accepted = 0, refused = 0, malformed = 0, dropped = 0;
    int connected = 0;    ///< WebSocket clients: pages and Foxglove
    int64_t unheard = 0;  ///< requests beyond kMostRequests
  };
  Counters counters() const;

  struct Hub;  ///< web.h

 private:
  std::unique_ptr<Hub> hub_;
};

}  // namespace chase::viewer
