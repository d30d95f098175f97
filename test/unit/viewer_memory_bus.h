#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "common/bus/bus.h"

namespace chase::viewer {

inline constexpr int64_t kSecond = 1000000;  // us

template <class T>
std::vector<uint8_t> BytesOf(const T& m) {
  std::vector<uint8_t> bytes(static_cast<size_t>(m.getEncodedSize()));
  m.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

/// Hands over bytes at once.
class MemoryBus : public bus::Bus {
 public:
  void Deliver(const std::string& channel, const std::vector<uint8_t>& bytes) {
    const auto it = handlers_.find(channel);
    if (it != handlers_.end()) it->second(bytes.data(), bytes.size());
  }
  template <class T>
  void Deliver(const std::string& channel, const T& m) {
    Deliver(channel, BytesOf(m));
  }
  int64_t Now() const override { return now; }
  int64_t now = 100 * kSecond;

 protected:
  void SubscribeRaw(const std::string& channel, RawHandler handler) override {
    handlers_[channel] = std::move(handler);
  }
  void PublishRaw(const std::string& channel, Bytes bytes) override {
    sent[channel].push_back(std::move(bytes));
  }

 public:
  std::map<std::string, std::vector<Bytes>> sent;

 private:
  std::map<std::string, RawHandler> handlers_;
};

}  // namespace chase::viewer
