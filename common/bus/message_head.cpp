#include "common/bus/message_head.h"

namespace chase::bus {
namespace {

constexpr size_t kFingerprintBytes = 8;

/// Big-endian, as LCM writes.
class Reader {
 public:
  Reader(const uint8_t* data, size_t size) : at_(data), left_(size) {}

  bool Skip(size_t bytes) {
    if (left_ < bytes) return false;
    at_ += bytes;
    left_ -= bytes;
    return true;
  }
  template <class T>
  bool Integer(T* value) {
    const uint8_t* from = at_;
    if (!Skip(sizeof(T))) return false;
    uint64_t bits = 0;
    for (size_t i = 0; i < sizeof(T); ++i) bits = bits << 8 | from[i];
    *value = static_cast<T>(bits);
    return true;
  }
  bool Text(std::string* text) {
    int32_t length = 0;  // with the zero at its end
    if (!Integer(&length) || length < 1) return false;
    const auto* from = reinterpret_cast<const char*>(at_);
    if (!Skip(static_cast<size_t>(length))) return false;
    text->assign(from, static_cast<size_t>(length) - 1);
    return true;
  }

 private:
  const uint8_t* at_;
  size_t left_;
};

}  // namespace

std::optional<MessageHead> HeadOf(const void* data, size_t size) {
  Reader reader(static_cast<const uint8_t*>(data), size);
  MessageHead head;
  int32_t inputs = 0;
  if (!reader.Skip(kFingerprintBytes) || !reader.Integer(&head.utime) ||
      !reader.Integer(&head.seq) || !reader.Text(&head.sender) || !reader.Text(&head.vehicle) ||
      !reader.Integer(&head.sender_start) || !reader.Integer(&inputs))
    return std::nullopt;
  for (int32_t i = 0; i < inputs; ++i) {
    MessageHead::Input input{};
    if (!reader.Text(&input.channel) || !reader.Integer(&input.seq)) return std::nullopt;
    head.inputs.push_back(std::move(input));
  }
  return head;
}

}  // namespace chase::bus
