#include "services/camera/grabber.h"

#include <chrono>
#include <exception>
#include <utility>

#include "common/bus/host_clock.h"

namespace chase::camera {
namespace {

constexpr std::chrono::milliseconds kPause(200);  // after a source gave nothing

}  // namespace

Grabber::Grabber(std::unique_ptr<FrameSource> source)
    : source_(std::move(source)), thread_([this] { Run(); }) {}

Grabber::~Grabber() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  stopped_.notify_all();
  thread_.join();
}

void Grabber::Run() {
  bool stop = false;
  while (!stop) {
    std::optional<Frame> frame;
    std::string problem;
    bool threw = false;
    try {
      frame = source_->Next();
      problem = source_->Problem();
    } catch (const std::exception& error) {
      problem = error.what();
      threw = true;
    }
    const int64_t arrival = bus::SteadyMicroseconds();
    std::unique_lock<std::mutex> lock(mutex_);
    problem_ = problem;
    if (threw) ++undecodable_;
    if (frame)
      Accept(std::move(*frame), arrival);
    else
      stopped_.wait_for(lock, kPause, [this] { return stop_; });
    stop = stop_;
  }
}

void Grabber::Accept(Frame frame, int64_t arrival) {
  if (frame.bgr.empty()) {
    ++undecodable_;
    problem_ = "a frame that is no picture";
    return;
  }
  if (newest_) ++dropped_;
  newest_ = Grabbed{std::move(frame), arrival};
}

std::optional<Grabber::Grabbed> Grabber::Take() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(newest_, std::nullopt);
}

long Grabber::dropped() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return dropped_;
}

long Grabber::undecodable() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return undecodable_;
}

std::string Grabber::Problem() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return problem_;
}

}  // namespace chase::camera
