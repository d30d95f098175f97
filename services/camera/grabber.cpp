#include "services/camera/grabber.h"

#include <chrono>
#include <utility>

namespace chase::camera {
namespace {

template <class Clock>
int64_t Microseconds() {
  const auto now = Clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::microseconds>(now).count();
}

}  // namespace

int64_t MonotonicTime() { return Microseconds<std::chrono::steady_clock>(); }
int64_t WallTime() { return Microseconds<std::chrono::system_clock>(); }

Grabber::Grabber(std::unique_ptr<FrameSource> source)
    : source_(std::move(source)), thread_([this] { Run(); }) {}

Grabber::~Grabber() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  thread_.join();
}

void Grabber::Run() {
  while (true) {
    std::optional<Frame> frame = source_->Next();
    const int64_t arrival = MonotonicTime();
    const std::lock_guard<std::mutex> lock(mutex_);
    if (stop_) return;
    problem_ = source_->Problem();
    if (!frame) continue;
    if (newest_) ++dropped_;
    newest_ = Grabbed{std::move(*frame), arrival};
  }
}

std::optional<Grabber::Grabbed> Grabber::Take() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(newest_, std::nullopt);
}

long Grabber::dropped() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return dropped_;
}

std::string Grabber::Problem() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return problem_;
}

}  // namespace chase::camera
