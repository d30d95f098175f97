#include "deploy/recorder/recorder_node.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <filesystem>

#include "common/bus/channels.h"

namespace chase::recorder {
namespace {

std::string NameOf(const RecorderConfig& config, int64_t utime) {
  return config.name.empty() ? fmt::format("{:%Y%m%d-%H%M%S}", fmt::gmtime(utime / 1000000))
                             : config.name;
}

/// Whatever vehicle it belongs to.
bool IsHeavyOfAny(const std::string& channel) {
  for (const auto& row : bus::ChannelTable()) {
    const size_t n = row.channel.size();
    if (row.heavy && channel.size() >= n &&
        channel.compare(channel.size() - n, n, row.channel) == 0)
      return true;
  }
  return false;
}

double Mega(int64_t bytes) { return 1e-6 * static_cast<double>(bytes); }

}  // namespace

RecorderNode::RecorderNode(bus::Bus& bus, const RecorderConfig& config)
    : bus_(bus), config_(config), recorder_(config, NameOf(config, bus.Now()), bus.Now()) {
  bus_.SubscribeEvery(
      [this](const std::string& channel, int64_t utime, const uint8_t* data, size_t size) {
        recorder_.Add(utime, channel, IsHeavyOfAny(channel), data, size);
      });
}

void RecorderNode::Tick(int64_t utime) { recorder_.Tick(utime, FreeBytes()); }

/// Where nobody can tell, the disk itself will.
int64_t RecorderNode::FreeBytes() const {
  std::error_code unknown;
  const auto space = std::filesystem::space(config_.folder, unknown);
  return unknown ? INT64_MAX : static_cast<int64_t>(space.available);
}

int64_t RecorderNode::Lost() const {
  int64_t lost = 0;
  for (const auto& [name, counters] : bus_.counters()) lost += counters.dropped;
  return lost;
}

bus::NodeReport RecorderNode::Report() const {
  using State = bus::NodeReport::State;
  const std::string written = fmt::format(
      "{} logs, {:.0f} MB, and {:.0f} MB of sweeps, images and maps; {} messages lost on "
      "the bus, {} not written",
      recorder_.files(), Mega(recorder_.light_bytes()), Mega(recorder_.heavy_bytes()), Lost(),
      recorder_.unrecorded());
  const std::string disk = fmt::format("{:.0f} MB free: ", Mega(FreeBytes()));
  if (recorder_.refused())
    return {State::kFailed, "the disk refuses, " + disk + "nothing is recorded; " + written};
  if (recorder_.heavy_given_up())
    return {State::kDegraded, "the disk is nearly full, " + disk +
                                  "sweeps, images and maps are left out; " + written};
  return {State::kOk, written};
}

}  // namespace chase::recorder
