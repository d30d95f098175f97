#include "services/viewer/log_player.h"

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "common/bus/channels.h"
#include "common/bus/stamp_order.h"
#include "common/logs/log_clock.h"

namespace chase::viewer {
namespace {

constexpr int64_t kLongest = 60000000;  // us between events; more is a clock that was set
constexpr int64_t kJump = 100000;       // us that a jump lasts: a tick

}  // namespace

LogPlayer::LogPlayer(const std::string& file) : reader_(file) {
  std::map<std::string, size_t> numbers;
  logs::LogClock clock;
  for (int64_t position = reader_.position(); reader_.Next(&event_);
       position = reader_.position()) {
    const auto [number, is_new] = numbers.emplace(event_.channel, channels_.size());
    if (is_new) channels_.push_back(event_.channel);
    index_.push_back({PlayingTime(clock.Add(event_)), position, number->second});
  }
  if (index_.empty()) throw std::runtime_error(file + ": holds no event; is it an LCM log?");
  jumps_ += static_cast<int>(clock.steps().size());
  damage_ = reader_.damage();
  handlers_.resize(channels_.size());
  heavy_.resize(channels_.size());
  now_ = begin();
}

int64_t LogPlayer::PlayingTime(int64_t stamp) {
  if (index_.empty()) return stamp;
  const int64_t last = index_.back().utime, utime = stamp - left_out_;
  if (utime >= last - bus::StampOrder::kLatest && utime <= last + kLongest)
    return std::max(utime, last);  // those that are late count as the one before
  ++jumps_;
  left_out_ = stamp - (last + kJump);
  return last + kJump;
}

std::string LogPlayer::Title() const {
  std::string title = std::filesystem::path(reader_.file()).filename().string();
  for (const bus::Damage& d : damage_) title += ", " + bus::Format(d);
  if (jumps_ > 0)
    title += ", without " + std::to_string(jumps_) + (jumps_ == 1 ? " jump" : " jumps") +
             " of its clock";
  return title;
}

/// A vehicle's prefix may stand before the channel's name, as for the tools that read logs, where
/// none has the name itself.
void LogPlayer::SubscribeRaw(const std::string& channel, RawHandler handler) {
  const bool plain = std::find(channels_.begin(), channels_.end(), channel) != channels_.end();
  bool found = false;
  for (size_t i = 0; i < channels_.size(); ++i) {
    const std::string& name = channels_[i];
    if (name.size() < channel.size() || (plain && name != channel) ||
        name.compare(name.size() - channel.size(), channel.size(), channel) != 0)
      continue;
    if (std::exchange(found, true))
      throw std::runtime_error(reader_.file() + ": holds " + channel +
                               " of several vehicles; keep one with chase-log filter");
    handlers_[i] = handler;
    heavy_[i] = bus::IsHeavy(channel);
    if (channel == "CAMERA_IMAGE") image_ = i;
    if (channel == "TARGET") target_ = i;
  }
}

void LogPlayer::HandOver(const Entry& entry) {
  if (!handlers_[entry.channel]) return;
  now_ = entry.utime;
  reader_.Seek(entry.position);
  if (reader_.Next(&event_)) handlers_[entry.channel](event_.bytes.data(), event_.bytes.size());
}

size_t LogPlayer::After(int64_t utime) const {
  const auto after = std::upper_bound(index_.begin(), index_.end(), utime,
                                      [](int64_t t, const Entry& e) { return t < e.utime; });
  return static_cast<size_t>(after - index_.begin());
}

std::vector<size_t> LogPlayer::LastOfEach(size_t from, size_t to) const {
  std::vector<size_t> last(channels_.size(), SIZE_MAX);
  for (size_t i = from; i < to; ++i) last[index_[i].channel] = i;
  return last;
}

void LogPlayer::Survey(int64_t period, const std::function<bool(int64_t utime)>& every) {
  if (std::none_of(handlers_.begin(), handlers_.end(), [](const auto& h) { return bool(h); }))
    throw std::runtime_error(reader_.file() + ": holds none of the channels that are shown");
  int64_t next = begin() + period;
  for (const Entry& entry : index_) {
    for (; next <= entry.utime; next += period) {
      now_ = next;
      if (!every(next)) return;
    }
    if (!heavy_[entry.channel]) HandOver(entry);
  }
}

void LogPlayer::Seek(int64_t utime) {
  next_ = After(utime);
  std::vector<size_t> last = LastOfEach(0, next_);
  if (image_ != SIZE_MAX && target_ != SIZE_MAX && last[target_] != SIZE_MAX)
    last.push_back(LastOfEach(0, last[target_])[image_]);
  std::sort(last.begin(), last.end());
  last.erase(std::unique(last.begin(), last.end()), last.end());
  for (const bool heavy : {false, true})
    for (const size_t i : last)
      if (i != SIZE_MAX && heavy_[index_[i].channel] == heavy) HandOver(index_[i]);
  now_ = utime;
}

void LogPlayer::PlayTo(int64_t utime) {
  const size_t to = std::max(After(utime), next_);
  const std::vector<size_t> last = LastOfEach(next_, to);
  for (; next_ < to; ++next_) {
    const Entry& entry = index_[next_];
    if (!heavy_[entry.channel] || last[entry.channel] == next_) HandOver(entry);
  }
  now_ = utime;
}

}  // namespace chase::viewer
