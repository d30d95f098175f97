#pragma once

#include <optional>
#include <string>
#include <vector>

#include "services/viewer/history.h"
#include "services/viewer/scene.h"

/// The texts that the page reads: JSON whose "type" says which. Numbers are rounded to a millimetre
/// or a thousandth; what is not finite is null.
namespace chase::viewer {

/// Where the player of a log is.
struct PlayState {
  double t = 0.0, duration = 0.0, speed = 1.0;  ///< s, s, log's seconds per second
  bool playing = false;
};

/// "state": the scene, t seconds from the beginning, drawn anew where `generation` differs from the
/// last one's. Its inputs have their age and, beyond kMostShownAge, are stale.
std::string StateText(const Scene& scene, double t, int generation,
                      const std::optional<PlayState>& play);

/// "obstacles" at t, told with the state of the time `told`, s from the beginning, of that scene.
std::string ObstaclesText(const std::vector<world::Obstacle>& obstacles, double t, double told,
                          int generation);

/// One process as its status message tells, and HEALTH.
struct ChannelHealth {
  std::string channel;
  double rate_hz = 0.0;
  int64_t dropped = 0, malformed = 0, foreign = 0;  ///< messages
};
struct ProcessHealth {
  std::string name, detail, last_error;
  int state = 0;             ///< status_t's constants
  double age = 0.0;          ///< since the status was heard, s; negative: never
  double cpu_percent = 0.0;  ///< of one core since the status before; negative: not known
  double rss_mb = 0.0;
  int restarts = -1;  ///< as the mission process counts; negative: not known
  std::vector<ChannelHealth> channels;
};
/// "health"; `self` is the viewer's own sentence.
std::string HealthText(const std::vector<ProcessHealth>& processes, const std::string& self);

/// "hello": what a new page must know. `source`: the log's name; empty when live.
std::string HelloText(const std::string& source, double duration, bool commands,
                      const History& history);

/// "reply" to a command. `refusal`: why it is refused; empty where the vehicle has taken it.
/// `words`: what it does then.
std::string ReplyText(const std::string& command, const std::string& refusal,
                      const std::string& words);

/// Byte 2, three zeros, uint32 length of a JSON text {t, width, height, box, state}, that text and
/// the JPEG.
std::string EncodeImage(double t, int width, int height, const std::optional<Target>& target,
                        const std::string& jpeg);

}  // namespace chase::viewer
