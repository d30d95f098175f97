#include "services/viewer/foxglove_feed.h"

#include <algorithm>

namespace chase::viewer {

bool FoxgloveFeed::Needs(const std::string& channel) const {
  const auto ids = of_channel_.find(channel);
  if (ids == of_channel_.end()) return true;
  return std::any_of(ids->second.begin(), ids->second.end(),
                     [&](uint32_t id) { return server_.Subscribed(id); });
}

uint32_t FoxgloveFeed::IdOf(const std::string& topic, const std::string& schema) {
  const auto known = ids_.find(topic);
  if (known != ids_.end()) return known->second;
  const auto id = static_cast<uint32_t>(ids_.size() + 1);
  ids_[topic] = id;
  if (id < Server::kMostChannels)
    server_.Advertise({id, topic, schema, logs::DescriptorsOf(schema)});
  return id;
}

void FoxgloveFeed::Convert(const std::string& channel, int64_t utime, std::vector<uint8_t> bytes) {
  std::vector<uint32_t> ids;
  for (auto& message : logs::ToViewer({utime, channel, std::move(bytes)}, options_)) {
    ids.push_back(IdOf(message.topic, message.schema));
    if (server_.Subscribed(ids.back()))
      server_.SendMessage(ids.back(), utime, std::move(message.bytes));
  }
  of_channel_[channel] = ids;
}

}  // namespace chase::viewer
