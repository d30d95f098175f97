#include "services/viewer/server.h"

#include <boost/asio/post.hpp>
#include <chrono>
#include <stdexcept>

#include "services/viewer/web.h"

namespace chase::viewer {
namespace {

namespace net = boost::asio;
using net::ip::tcp;

constexpr int kMostPending = 512;  // pieces handed to the server's thread and not yet dealt out
constexpr auto kPause = std::chrono::milliseconds(100);  // when the host has no sockets left

void Accept(Server::Hub& hub);

void Welcome(tcp::socket socket, Server::Hub& hub) {
  if (hub.connected.load() >= hub.config.max_clients) {
    ++hub.refused;
    return;  // closes it
  }
  ++hub.accepted;
  ServeConnection(std::move(socket), hub);
}

void Accept(Server::Hub& hub) {
  hub.acceptor.async_accept([&hub](const boost::system::error_code& error, tcp::socket socket) {
    if (error == net::error::operation_aborted) return;
    if (!error) {
      Welcome(std::move(socket), hub);
      return Accept(hub);
    }
    hub.pause.expires_after(kPause);
    hub.pause.async_wait([&hub](const boost::system::error_code& stopped) {
      if (!stopped) Accept(hub);
    });
  });
}

/// What a connection throws, such as bad_alloc, ends no other.
void Work(Server::Hub& hub) {
  while (!hub.io.stopped()) {
    try {
      hub.io.run();
    } catch (const std::exception&) {
      ++hub.malformed;
    }
  }
}

void Listen(Server::Hub& hub) {
  const ServerConfig& c = hub.config;
  try {
    const tcp::endpoint endpoint(net::ip::make_address(c.address), static_cast<uint16_t>(c.port));
    hub.acceptor.open(endpoint.protocol());
    hub.acceptor.set_option(net::socket_base::reuse_address(true));
    hub.acceptor.bind(endpoint);
    hub.acceptor.listen();
    hub.port = hub.acceptor.local_endpoint().port();
  } catch (const boost::system::system_error& error) {
    throw std::runtime_error(c.address + ":" + std::to_string(c.port) +
                             ": cannot be listened on (" + error.code().message() +
                             "); choose another with --port");
  }
}

template <class F>
void Post(Server::Hub& hub, F work) {
  if (hub.pending.load() >= kMostPending) {
    ++hub.dropped;
    return;
  }
  ++hub.pending;
  net::post(hub.io, [&hub, work = std::move(work)] {
    --hub.pending;
    work();
  });
}

Frame FrameOf(Part part, std::string bytes, bool binary) {
  return {static_cast<int>(part), std::make_shared<const std::string>(std::move(bytes)), binary};
}

}  // namespace

void Server::Hub::Recount() {
  int count = 0;
  bool cloud = false, image = false;
  for (const Client* client : clients) {
    count += client->IsPage() ? 1 : 0;
    cloud = cloud || client->Wants(Part::kCloud);
    image = image || client->Wants(Part::kImage);
  }
  pages = count;
  sockets = static_cast<int>(clients.size());
  wants_cloud = cloud;
  wants_image = image;
  std::array<bool, kMostChannels> marked{};
  for (const Client* client : clients) client->MarkSubscribed(&marked);
  for (uint32_t id = 0; id < kMostChannels; ++id) subscribed[id] = marked[id];
}

void Server::Hub::Ask(const Request& request) {
  const std::lock_guard lock(inbox_mutex);
  if (asked[request.caller]++ < kMostRequests)
    inbox.push_back(request);
  else
    ++unheard;
}

Server::Server(const ServerConfig& config, Assets assets)
    : hub_(std::make_unique<Hub>(config, std::move(assets))) {
  Listen(*hub_);
  hub_->session = std::to_string(std::chrono::system_clock::now().time_since_epoch().count());
  Accept(*hub_);
  hub_->thread = std::thread([hub = hub_.get()] { Work(*hub); });
}

Server::~Server() {
  hub_->io.stop();
  hub_->thread.join();
}

int Server::port() const { return hub_->port; }

void Server::Send(Part part, std::string bytes, bool binary) {
  Post(*hub_, [hub = hub_.get(), part, frame = FrameOf(part, std::move(bytes), binary)] {
    if (part == Part::kObstacles || part == Part::kHealth) hub->retained[part] = frame;
    for (Client* client : hub->clients) client->OfferPart(part, frame);
  });
}

void Server::Retain(Part part, std::string bytes) {
  Post(*hub_, [hub = hub_.get(), part, frame = FrameOf(part, std::move(bytes), false)] {
    hub->retained[part] = frame;
  });
}

int Server::pages() const { return hub_->pages; }

bool Server::Wanted(Part part) const {
  if (part == Part::kCloud) return hub_->wants_cloud;
  if (part == Part::kImage) return hub_->wants_image;
  return pages() > 0;
}

std::vector<Request> Server::TakeRequests() {
  const std::lock_guard lock(hub_->inbox_mutex);
  hub_->asked.clear();
  return std::exchange(hub_->inbox, {});
}

void Server::Answer(const Request& request, const std::string& refusal, const std::string& words) {
  net::post(hub_->io, [hub = hub_.get(), request, refusal, words] {  // few, and never left out
    for (Client* client : hub->clients) client->OfferAnswer(request, refusal, words);
  });
}

void Server::Advertise(const FoxgloveChannel& channel) {
  net::post(hub_->io, [hub = hub_.get(), channel] {  // few, and never left out
    hub->channels.push_back(channel);
    const std::string text = AdvertiseText({channel});
    for (Client* client : hub->clients) client->OfferChannels(text);
  });
}

bool Server::Subscribed(uint32_t channel) const {
  return channel < kMostChannels && hub_->subscribed[channel];
}

void Server::SendMessage(uint32_t channel, int64_t utime, std::string payload) {
  Post(*hub_, [hub = hub_.get(), channel, utime, payload = std::move(payload)] {
    for (Client* client : hub->clients) client->OfferMessage(channel, utime, payload);
  });
}

Server::Counters Server::counters() const {
  return {hub_->accepted, hub_->refused, hub_->malformed,
          hub_->dropped,  hub_->sockets, hub_->unheard};
}

}  // namespace chase::viewer
