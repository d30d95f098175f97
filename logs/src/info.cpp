#include "logs/src/info.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "logs/src/log_reader.h"
#include "logs/src/message_fields.h"

namespace chase::logs {

double ChannelInfo::RateHz() const {
  const double span = static_cast<double>(last_utime - first_utime) * 1e-6;
  return span > 0.0 ? static_cast<double>(count - 1) / span : 0.0;
}

LogInfo Describe(const std::string& file) {
  LogReader log(file);
  std::map<std::string, ChannelInfo> channels;
  for (Event e; log.Next(&e);) {
    ChannelInfo& c = channels[e.channel];
    if (c.count++ == 0) {
      c.channel = e.channel;
      c.type = TypeOf(e.bytes);
      c.first_utime = c.last_utime = e.utime;
    }
    c.bytes += static_cast<int64_t>(e.bytes.size());
    c.first_utime = std::min(c.first_utime, e.utime);  // live logs may step back by a millisecond
    c.last_utime = std::max(c.last_utime, e.utime);
  }
  LogInfo info;
  for (auto& [name, channel] : channels) info.channels.push_back(std::move(channel));
  info.unread_bytes = log.unread_bytes();
  return info;
}

std::string Format(const LogInfo& info) {
  std::string text = fmt::format("{:<20} {:<20} {:>8} {:>11} {:>12} {:>18} {:>18}\n", "channel",
                                 "type", "count", "rate", "bytes", "first [s]", "last [s]");
  for (const ChannelInfo& c : info.channels)
    text += fmt::format("{:<20} {:<20} {:>8} {:>8.2f} Hz {:>12} {:>18.6f} {:>18.6f}\n", c.channel,
                        c.type.empty() ? "-" : c.type, c.count, c.RateHz(), c.bytes,
                        static_cast<double>(c.first_utime) * 1e-6,
                        static_cast<double>(c.last_utime) * 1e-6);
  if (info.unread_bytes > 0)
    text += fmt::format("the last {} bytes are no whole event: the log was cut off\n",
                        info.unread_bytes);
  return text;
}

}  // namespace chase::logs
