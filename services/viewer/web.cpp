#include "services/viewer/web.h"

#include <algorithm>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <chrono>
#include <optional>
#include <utility>

#include "services/viewer/page_text.h"

namespace chase::viewer {
namespace {

namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using boost::asio::ip::tcp;
using Error = beast::error_code;
using HttpRequest = http::request<http::string_body>;

constexpr auto kHttpLimit = std::chrono::seconds(10);   // for a whole request, and between two
constexpr auto kSilence = std::chrono::seconds(30);     // of a WebSocket client; half of it: a ping
constexpr size_t kMostHeader = 8192, kMostBody = 4096;  // bytes of an HTTP request
constexpr size_t kMostText = 65536;                     // bytes of a client's message
constexpr int kSendBuffer = 65536;  // bytes in the kernel: 0.3 s of a link of 200 kB/s
constexpr OutboxLimits kPageLimits = {1, 4000000,
                                      49152};  // under way: a quarter second of that link
constexpr OutboxLimits kFoxgloveLimits = {64, 8000000, 0};
constexpr int kAnswer = -1, kAdvertisement = -2;  // keys of frames

using Slot = std::shared_ptr<void>;  ///< a place among the connections

std::shared_ptr<const std::string> Shared(std::string bytes) {
  return std::make_shared<const std::string>(std::move(bytes));
}

std::string ProtocolOf(const HttpRequest& request) {
  const beast::string_view offered = request[http::field::sec_websocket_protocol];
  for (const auto& token : http::token_list(offered))
    for (const char* ours : kFoxgloveProtocols)
      if (token == ours) return ours;
  return "";
}

class WebSocket : public Client, public std::enable_shared_from_this<WebSocket> {
 public:
  WebSocket(beast::tcp_stream stream, Server::Hub& hub, Slot slot, const std::string& protocol)
      : stream_(std::move(stream)),
        hub_(hub),
        slot_(std::move(slot)),
        outbox_(protocol.empty() ? kPageLimits : kFoxgloveLimits) {
    if (!protocol.empty()) foxglove_.emplace(&hub.config.parameters);
    number_ = ++hub.last_client;
    websocket::stream_base::timeout timeout{kHttpLimit, kSilence, true};
    stream_.set_option(timeout);
    stream_.read_message_max(kMostText);
    stream_.set_option(websocket::stream_base::decorator([protocol](auto& response) {
      if (!protocol.empty()) response.set(http::field::sec_websocket_protocol, protocol);
    }));
  }
  ~WebSocket() override {
    hub_.dropped += outbox_.dropped();
    if (hub_.clients.erase(this) > 0) hub_.Recount();
  }

  void Run(const HttpRequest& request) {
    stream_.async_accept(request, [self = shared_from_this()](Error error) {
      if (!error) self->Begin();
    });
  }

  void OfferPart(Part part, const Frame& frame) override {
    const bool heavy = part == Part::kCloud || part == Part::kImage;
    if (IsPage() && (!heavy || Wants(part))) Push(frame);
  }
  void OfferChannels(const std::string& advertisement) override {
    if (foxglove_) PushText(kAdvertisement, advertisement);
  }
  void OfferMessage(uint32_t channel, int64_t utime, const std::string& payload) override {
    if (!foxglove_ || choked_) return;
    for (const auto& [subscription, id] : foxglove_->channels())
      if (id == channel)
        Push({static_cast<int>(channel), Shared(MessageData(subscription, utime, payload)), true});
  }
  void OfferAnswer(const Request& request, const std::string& refusal,
                   const std::string& words) override {
    const bool own = request.caller == number_;
    if (foxglove_ && own)
      Push({kAnswer, Shared(CommandAnswer(request.call, refusal, words)), true});
    if (!foxglove_ && (own || refusal.empty()))
      Push({static_cast<int>(Part::kReply), Shared(ReplyText(request.command, refusal, words)),
            false});
  }
  bool Wants(Part part) const override {
    return (part == Part::kCloud && wants_cloud_) || (part == Part::kImage && wants_image_);
  }
  void MarkSubscribed(std::array<bool, Server::kMostChannels>* channels) const override {
    if (!foxglove_ || choked_) return;
    for (const auto& [subscription, id] : foxglove_->channels())
      if (id < channels->size()) (*channels)[id] = true;
  }
  bool IsPage() const override { return !foxglove_; }

 private:
  void Begin() {
    hub_.clients.insert(this);
    hub_.Recount();
    if (foxglove_) {
      PushText(kAnswer, ServerInfoText("chase", hub_.session, hub_.config.commands));
      PushText(kAdvertisement, AdvertiseText(hub_.channels));
      if (hub_.config.commands) PushText(kAnswer, AdvertiseServiceText());
    } else {
      for (const auto& [part, frame] : hub_.retained) Push(frame);
    }
    Read();
  }

  void Read() {
    stream_.async_read(buffer_, [self = shared_from_this()](Error error, size_t) {
      if (error) return;
      const std::string text = beast::buffers_to_string(self->buffer_.data());
      self->buffer_.clear();
      if (self->stream_.got_text())
        self->Hear(text);
      else
        self->HearBinary(text);
      self->Read();
    });
  }

  void Hear(const std::string& text) {
    if (foxglove_) {
      const size_t before = foxglove_->channels().size();
      const std::string answer = foxglove_->Hear(text);
      hub_.Recount();
      if (foxglove_->channels().size() > before) Look();
      if (!answer.empty()) PushText(kAnswer, answer);
      return;
    }
    auto request = ParseRequest(text);
    if (!request) {
      ++hub_.malformed;
      return;
    }
    outbox_.Acknowledge(request->acknowledged);
    if (request->wants) Want(*request->wants);
    request->wants.reset();  // nothing long waits in the inbox
    request->caller = number_;
    if (request->play || request->speed || request->seek || !request->command.empty())
      hub_.Ask(*request);
    Flush();
  }

  /// A call of Foxglove's service, where it is offered.
  void HearBinary(const std::string& bytes) {
    const auto call = foxglove_ && hub_.config.commands ? ServiceCallOf(bytes) : std::nullopt;
    auto request = call ? ParseRequest(call->payload) : std::nullopt;
    if (!request || request->command.empty()) {
      ++hub_.malformed;
      if (call) PushText(kAnswer, CallFailureText(*call));
      return;
    }
    Request command;
    command.command = request->command;
    command.token = request->token;
    command.utime = request->utime;
    command.caller = number_;
    command.call = call->call;
    hub_.Ask(command);
  }

  void Want(const std::vector<std::string>& parts) {
    wants_cloud_ = std::find(parts.begin(), parts.end(), "cloud") != parts.end();
    wants_image_ = std::find(parts.begin(), parts.end(), "image") != parts.end();
    hub_.Recount();
    if (!parts.empty()) Look();
  }
  void Look() {
    Request request;
    request.caller = number_;
    request.looks = true;
    hub_.Ask(request);
  }

  void PushText(int key, const std::string& text) { Push({key, Shared(text), false}); }
  void Push(Frame frame) {
    outbox_.Push(std::move(frame));
    Flush();
    Choke();
  }
  /// A client that does not keep up is sent nothing more until it has: nothing is converted for it.
  void Choke() {
    const size_t most = kFoxgloveLimits.waiting;
    const bool choked = foxglove_ && outbox_.waiting() > (choked_ ? most / 8 : most / 2);
    if (std::exchange(choked_, choked) != choked) hub_.Recount();
  }
  void Flush() {
    if (writing_) return;
    auto frame = outbox_.Next();
    if (!frame) return;
    writing_ = std::move(frame->bytes);
    stream_.binary(frame->binary);
    stream_.async_write(boost::asio::buffer(*writing_),
                        [self = shared_from_this()](Error error, size_t) {
                          self->writing_.reset();
                          if (!error) self->Flush();
                          if (self->choked_) self->Choke();
                        });
  }

  websocket::stream<beast::tcp_stream> stream_;
  Server::Hub& hub_;
  Slot slot_;
  uint64_t number_ = 0;  ///< among all clients, from 1
  beast::flat_buffer buffer_;
  Outbox outbox_;
  std::shared_ptr<const std::string> writing_;
  std::optional<FoxgloveClient> foxglove_;  ///< none: a page
  bool wants_cloud_ = false, wants_image_ = false, choked_ = false;
};

class Http : public std::enable_shared_from_this<Http> {
 public:
  Http(tcp::socket socket, Server::Hub& hub)
      : stream_(std::move(socket)), hub_(hub), slot_(nullptr, [&hub](void*) { --hub.connected; }) {
    ++hub.connected;
  }

  void Read() {
    parser_.emplace();
    parser_->header_limit(kMostHeader);
    parser_->body_limit(kMostBody);
    stream_.expires_after(kHttpLimit);
    http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](Error error, size_t) {
      if (error == http::error::end_of_stream) return;
      if (error) {
        if (error != beast::error::timeout) ++self->hub_.malformed;
        return;
      }
      self->Answer(self->parser_->release());
    });
  }

 private:
  void Answer(const HttpRequest& request) {
    if (websocket::is_upgrade(request)) return Upgrade(request);
    const bool read = request.method() == http::verb::get || request.method() == http::verb::head;
    if (!read)
      return Reply(request, http::status::method_not_allowed, {"only GET\n", "text/plain"});
    const std::string target(request.target().substr(0, request.target().find('?')));
    const auto asset = hub_.assets.find(target);
    if (asset == hub_.assets.end())
      return Reply(request, http::status::not_found, {"no such page\n", "text/plain"});
    Reply(request, http::status::ok, asset->second);
  }

  void Upgrade(const HttpRequest& request) {
    const std::string protocol = ProtocolOf(request);
    if (protocol.empty() && request.target() != "/ws")
      return Reply(request, http::status::not_found, {"the page's data is at /ws\n", "text/plain"});
    stream_.expires_never();  // the WebSocket has its own limits
    std::make_shared<WebSocket>(std::move(stream_), hub_, slot_, protocol)->Run(request);
  }

  void Reply(const HttpRequest& request, http::status status, const Asset& asset) {
    response_ = {status, request.version()};
    response_.set(http::field::content_type, asset.type);
    response_.set(http::field::cache_control, "no-cache");
    response_.set("X-Content-Type-Options", "nosniff");
    response_.set("Content-Security-Policy",
                  "default-src 'self'; img-src 'self' blob: data:; connect-src 'self' ws: wss:");
    if (asset.gzip) response_.set(http::field::content_encoding, "gzip");
    if (request.method() != http::verb::head) response_.body() = asset.bytes;
    response_.keep_alive(request.keep_alive());
    response_.prepare_payload();
    stream_.expires_after(kSilence);  // of a slow link: 200 kB take a second at 200 kB/s
    http::async_write(stream_, response_, [self = shared_from_this()](Error error, size_t) {
      if (!error && self->response_.keep_alive()) self->Read();
    });
  }

  beast::tcp_stream stream_;
  Server::Hub& hub_;
  Slot slot_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::string_body>> parser_;
  http::response<http::string_body> response_;
};

}  // namespace

void ServeConnection(tcp::socket socket, Server::Hub& hub) {
  Error ignored;
  socket.set_option(boost::asio::socket_base::send_buffer_size(kSendBuffer), ignored);
  socket.set_option(tcp::no_delay(true), ignored);
  std::make_shared<Http>(std::move(socket), hub)->Read();
}

}  // namespace chase::viewer
