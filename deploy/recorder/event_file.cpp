#include "deploy/recorder/event_file.h"

#include <stdio_ext.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstring>
#include <stdexcept>

namespace chase::recorder {
namespace {

constexpr int64_t kHeader = 28;  // bytes of an event besides its channel and data

}  // namespace

EventFile::EventFile(const std::string& name)
    : name_(name), log_(lcm_eventlog_create(name.c_str(), "w")) {
  if (!log_)
    throw std::runtime_error(name + ": cannot be written (" + std::strerror(errno) +
                             "); check the folder, its rights and the disk");
}

EventFile::~EventFile() {
  if (!Flush() || !syncing_.valid()) return;
  syncing_.wait();
  Sync();
}

bool EventFile::Write(int64_t utime, const std::string& channel, const uint8_t* data, size_t size) {
  if (!log_) return false;
  lcm_eventlog_event_t event{};
  event.timestamp = utime;
  event.channellen = static_cast<int32_t>(channel.size());
  event.datalen = static_cast<int32_t>(size);
  event.channel = const_cast<char*>(channel.data());  // read only, though their types do not say so
  event.data = const_cast<uint8_t*>(data);
  ++waiting_;
  if (lcm_eventlog_write_event(log_.get(), &event) != 0) return GiveUp();
  written_ += kHeader + static_cast<int64_t>(channel.size() + size);
  return true;
}

bool EventFile::Flush() {
  if (!log_) return false;
  if (std::fflush(log_->f) != 0) return GiveUp();
  flushed_ = written_;
  waiting_ = 0;
  Sync();
  return true;
}

bool EventFile::IsOnDisk() {
  if (log_) Sync();
  return !IsSyncing() && (!log_ || synced_ == flushed_);
}

bool EventFile::IsSyncing() const {
  return syncing_.valid() &&
         syncing_.wait_for(std::chrono::seconds(0)) != std::future_status::ready;
}

/// Until then a loss of power takes what the system keeps in memory: half a minute.
void EventFile::Sync() {
  if (IsSyncing() || synced_ == flushed_) return;
  synced_ = flushed_;
  syncing_ = std::async(std::launch::async, [own = dup(fileno(log_->f))] {
    fdatasync(own);
    close(own);
  });
}

bool EventFile::GiveUp() {
  __fpurge(log_->f);  // what closing would try to write again
  if (ftruncate(fileno(log_->f), flushed_) != 0) flushed_ = 0;  // read over as damage
  log_.reset();
  lost_ += waiting_;
  waiting_ = 0;
  written_ = flushed_;
  return false;
}

}  // namespace chase::recorder
