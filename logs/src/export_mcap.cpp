#include <stdexcept>

#include "logs/src/export.h"
#include "logs/src/log_reader.h"
#include "logs/src/mcap_writer.h"
#include "logs/src/message_json.h"

namespace chase::logs {

long ExportMcap(const std::string& log, const std::string& out, const std::string& channel,
                const Watch& watch) {
  LogReader reader(log, watch);
  McapWriter writer(out);
  long count = 0;
  for (Event e; reader.Next(&e);) {
    if (!channel.empty() && e.channel != channel) continue;
    const auto message = ToViewer(e.bytes);
    if (!message) continue;
    if (!writer.HasChannel(e.channel)) {
      nlohmann::ordered_json schema = SchemaOf(message->json);
      schema["title"] = message->schema;
      if (message->schema.rfind("foxglove.", 0) == 0)
        schema["properties"]["data"]["contentEncoding"] = "base64";
      writer.AddChannel(e.channel, message->schema, schema.dump());
    }
    writer.Write(e.channel, e.utime, message->json.dump());
    ++count;
  }
  if (count == 0) RefuseEmpty(log, channel);
  writer.Close();
  return count;
}

}  // namespace chase::logs
