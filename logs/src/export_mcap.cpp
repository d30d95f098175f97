#include "common/logs/log_reader.h"
#include "common/logs/message_types.h"
#include "logs/src/export.h"
#include "logs/src/mcap_writer.h"

namespace chase::logs {

long ExportMcap(const std::string& log, const std::string& out, const std::string& channel,
                ViewerOptions options, const Watch& watch) {
  LogReader reader(log, watch);
  McapWriter writer(out);
  long count = 0;
  for (LogEvent e; reader.Next(&e);) {
    if (plan_t plan; DecodeBytes(e.bytes, &plan))
      options.hard_radius[plan.vehicle] = plan.hard_radius;
    if (!channel.empty() && e.channel != channel) continue;
    const auto messages = ToViewer(e, options);
    for (const ViewerMessage& m : messages) {
      if (!writer.HasChannel(m.topic))
        writer.AddChannel(m.topic, m.schema, DescriptorsOf(m.schema));
      writer.Write(m.topic, e.utime, m.bytes);
    }
    count += !messages.empty();
  }
  if (count == 0) RefuseEmpty(log, channel);
  writer.Close();
  return count;
}

}  // namespace chase::logs
