#include "deploy/recorder/recorder.h"

#include <fmt/format.h>
#include <sys/stat.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>
#include <system_error>

namespace chase::recorder {
namespace {

constexpr double kMega = 1e6, kMinute = 60e6;  // bytes; us
constexpr int64_t kRetry = 1'000'000;          // us between two tries on a disk that refuses
constexpr double kPieces = 5.0;                // logs that the heavy minutes are made of
constexpr double kEnough = 1.2;                // of keep_free_mb, before heavy ones are taken again
constexpr char kHeavy[] = "-heavy";            // in the names of logs of sweeps and images

/// When a file was written last, us since 1970; far ahead where nobody can say: it is kept.
int64_t WriteTime(const std::string& file) {
  struct stat found {};
  if (stat(file.c_str(), &found) != 0) return INT64_MAX;
  return found.st_mtim.tv_sec * int64_t{1'000'000} + found.st_mtim.tv_nsec / 1000;
}

}  // namespace

Recorder::Recorder(const RecorderConfig& config, const std::string& name, int64_t utime)
    : config_(config) {
  light_.name = config.folder + "/" + name;
  heavy_.name = light_.name + kHeavy;
  FindEarlierHeavy();
  if (!Open(utime, &light_))
    throw std::runtime_error(light_.name +
                             ".lcm: cannot be written; check the folder, its rights "
                             "and the disk");
}

Recorder::~Recorder() {
  Retire(&heavy_);
  Retire(&light_);
}

/// Those of recorders before this one, which are not there to drop them any more.
void Recorder::FindEarlierHeavy() {
  namespace fs = std::filesystem;
  std::error_code ignored;
  for (const fs::directory_entry& file : fs::directory_iterator(config_.folder, ignored)) {
    const std::string name = file.path().stem().string();
    const size_t at = name.rfind(kHeavy), end = at + sizeof kHeavy - 1;
    const bool numbered = at != std::string::npos && (end == name.size() || name[end] == '-');
    if (numbered && file.path().extension() == ".lcm")
      earlier_heavy_.push_back({file.path().string(), static_cast<int64_t>(file.file_size(ignored)),
                                WriteTime(file.path())});
  }
  std::sort(earlier_heavy_.begin(), earlier_heavy_.end(),
            [](const Old& a, const Old& b) { return a.last_utime < b.last_utime; });
}

/// NAME.lcm, then NAME-001.lcm and so on; a log that is there already is left alone.
bool Recorder::Open(int64_t utime, Series* series) {
  std::string name;
  do {
    name = series->count == 0 ? series->name + ".lcm"
                              : fmt::format("{}-{:03}.lcm", series->name, series->count);
    ++series->count;
  } while (std::filesystem::exists(name) && std::filesystem::file_size(name) > 0);
  try {
    series->file = std::make_unique<EventFile>(name);
  } catch (const std::runtime_error&) {
    --series->count;
    return false;
  }
  series->since = utime;
  return true;
}

bool Recorder::IsFull(int64_t utime, const Series& series, double minutes) const {
  const double mb = static_cast<double>(series.file->bytes()) / kMega;
  return (config_.rotate_mb > 0.0 && mb >= config_.rotate_mb) ||
         (minutes > 0.0 && static_cast<double>(utime - series.since) >= minutes * kMinute);
}

/// Ends the log of a series; an empty one is no log.
void Recorder::Retire(Series* series) {
  if (!series->file) return;
  series->file->Flush();
  unrecorded_ += series->file->lost();
  const Old old{series->file->name(), series->file->bytes(), series->last_utime};
  ending_.push_back(std::move(series->file));
  if (old.bytes == 0) {
    std::filesystem::remove(old.name);
    --series->count;
  } else if (series == &heavy_) {
    old_heavy_.push_back(old);
  } else {
    light_bytes_ += old.bytes;
  }
}

bool Recorder::Put(int64_t utime, const std::string& channel, const uint8_t* data, size_t size,
                   Series* series) {
  const double minutes =
      series == &heavy_ ? config_.heavy_minutes / kPieces : config_.rotate_minutes;
  if (series->file && IsFull(utime, *series, minutes)) Retire(series);
  if (!series->file && !Open(utime, series)) return false;
  series->last_utime = utime;
  return series->file->Write(utime, channel, data, size);
}

void Recorder::Add(int64_t utime, const std::string& channel, bool heavy, const uint8_t* data,
                   size_t size) {
  const bool apart = heavy && config_.heavy_minutes >= 0.0;
  if (apart && config_.heavy_minutes == 0.0) return;
  room_ -= static_cast<int64_t>(size);  // until the next tick looks
  if (heavy && !heavy_given_up_) MindTheDisk();
  if ((heavy && heavy_given_up_) || (refused_ && utime < next_try_)) {
    ++unrecorded_;
    return;
  }
  Series* series = apart ? &heavy_ : &light_;
  if (Put(utime, channel, data, size, series)) return;
  unrecorded_ += series->file ? 0 : 1;  // a file counts its own
  Refused(utime, series);
}

/// The disk refuses: its log ends, the oldest sweeps and images make room for it, and it is tried
/// anew in another log.
void Recorder::Refused(int64_t utime, Series* series) {
  Retire(series);
  heavy_given_up_ = true;
  const bool room = DropOldestHeavy() > 0;
  if (series == &heavy_) return;
  refused_ = true;
  next_try_ = room ? utime : utime + kRetry;
}

int64_t Recorder::heavy_bytes() const {
  int64_t bytes = heavy_.file ? heavy_.file->bytes() : 0;
  for (const Old& old : old_heavy_) bytes += old.bytes;
  return bytes;
}

/// Bytes that became free; 0: there are no heavy logs any more.
int64_t Recorder::DropOldestHeavy() {
  if (!earlier_heavy_.empty()) return DropFirst(&earlier_heavy_);
  if (old_heavy_.empty()) Retire(&heavy_);
  return old_heavy_.empty() ? 0 : DropFirst(&old_heavy_);
}

int64_t Recorder::DropFirst(std::deque<Old>* logs) {
  const Old old = logs->front();
  logs->pop_front();
  std::error_code ignored;
  std::filesystem::resize_file(old.name, 0, ignored);  // free, though it may be open still
  std::filesystem::remove(old.name, ignored);
  return old.bytes;
}

/// Those of earlier recorders may be what is left of a crash: they only go for room.
void Recorder::DropOldHeavy(int64_t utime) {
  if (config_.heavy_minutes <= 0.0) return;
  const auto age = static_cast<int64_t>(config_.heavy_minutes * kMinute);
  while (!old_heavy_.empty() && utime - old_heavy_.front().last_utime > age) DropFirst(&old_heavy_);
}

void Recorder::MindTheDisk() {
  const double keep = config_.keep_free_mb * kMega;
  while (static_cast<double>(room_) < keep && !(earlier_heavy_.empty() && old_heavy_.empty()))
    room_ += DropOldestHeavy();
  if (static_cast<double>(room_) < keep)
    heavy_given_up_ = true;
  else if (static_cast<double>(room_) >= kEnough * keep && !refused_)
    heavy_given_up_ = false;
}

void Recorder::FlushAll(int64_t utime) {
  ending_.remove_if([](const auto& file) { return file->IsOnDisk(); });
  if (heavy_.file && !heavy_.file->Flush()) Refused(utime, &heavy_);
  if (!light_.file) return;
  const bool any = light_.file->bytes() > 0;
  if (!light_.file->Flush())
    Refused(utime, &light_);
  else if (any)
    refused_ = false;
}

void Recorder::Tick(int64_t utime, int64_t free_bytes) {
  FlushAll(utime);
  DropOldHeavy(utime);
  room_ = free_bytes;
  MindTheDisk();
}

}  // namespace chase::recorder
