#include "common/logs/log_reader.h"
#include "common/logs/message_types.h"
#include "logs/src/export.h"
#include "logs/src/good_message.h"
#include "logs/src/mcap_writer.h"

namespace chase::logs {

long ExportMcap(const std::string& log, const std::string& out, const std::string& channel,
                ViewerOptions options, bool rig_named, const Watch& watch, Notes* notes) {
  LogReader reader(log, watch);
  McapWriter writer(out);
  OneVehicle vehicle(log);  // there is one /tf
  Unreadable unreadable;
  long count = 0;
  bool images = false, frames = false;
  for (LogEvent e; reader.Next(&e);) {
    if (plan_t plan; DecodeBytes(e.bytes, &plan))
      options.hard_radius[plan.vehicle] = plan.hard_radius;
    if (!channel.empty() && e.channel != channel) continue;
    vehicle.Hear(e.channel);
    unreadable.Add(e);
    const auto messages = ToViewer(e, options);
    for (const ViewerMessage& m : messages) {
      images |= m.schema == "foxglove.CameraCalibration";
      frames |= m.schema == "foxglove.FrameTransforms";
      if (!writer.HasChannel(m.topic))
        writer.AddChannel(m.topic, m.schema, DescriptorsOf(m.schema));
      writer.Write(m.topic, e.utime, m.bytes);
    }
    count += !messages.empty();
  }
  if (notes) *notes = unreadable.Lines();
  if (count == 0) RefuseEmpty(log, channel, unreadable.Lines());
  if (options.jpeg && !images)
    throw BadOption("--jpeg: does nothing, as no image is exported; leave it out");
  if (rig_named && !images && !frames)
    throw BadOption("--rig: does nothing, as neither POSE nor an image is exported; leave it out");
  writer.Close();
  return count;
}

}  // namespace chase::logs
