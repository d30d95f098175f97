#include "services/viewer/outbox.h"

#include <algorithm>

namespace chase::viewer {

void Outbox::Push(Frame frame) {
  const auto same = [&](const Frame& f) { return f.key == frame.key; };
  const auto oldest = std::find_if(frames_.begin(), frames_.end(), same);
  waiting_ += frame.bytes->size();
  if (limits_.depth == 1 && oldest != frames_.end()) {  // it keeps its place in the queue
    waiting_ -= oldest->bytes->size();
    *oldest = std::move(frame);
    ++dropped_;
    return;
  }
  if (std::count_if(frames_.begin(), frames_.end(), same) >= limits_.depth) Drop(oldest);
  frames_.push_back(std::move(frame));
  const auto spare = [](const Frame& f) { return f.key >= 0; };
  while (waiting_ > limits_.waiting && frames_.size() > 1) {
    const auto first = std::find_if(frames_.begin(), frames_.end(), spare);
    Drop(first == frames_.end() ? frames_.begin() : first);
  }
}

void Outbox::Drop(const std::deque<Frame>::const_iterator& frame) {
  waiting_ -= frame->bytes->size();
  frames_.erase(frame);
  ++dropped_;
}

std::optional<Frame> Outbox::Next() {
  if (frames_.empty()) return std::nullopt;
  if (limits_.unacknowledged > 0 && under_way_bytes_ >= limits_.unacknowledged) return std::nullopt;
  Frame frame = std::move(frames_.front());
  frames_.pop_front();
  waiting_ -= frame.bytes->size();
  if (limits_.unacknowledged > 0) {
    under_way_.push_back(frame.bytes->size());
    under_way_bytes_ += frame.bytes->size();
  }
  return frame;
}

void Outbox::Acknowledge(int64_t frames) {
  for (; frames > 0 && !under_way_.empty(); --frames) {
    under_way_bytes_ -= under_way_.front();
    under_way_.pop_front();
  }
}

}  // namespace chase::viewer
