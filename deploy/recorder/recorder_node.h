#pragma once

#include "common/bus/bus.h"
#include "common/bus/node.h"
#include "deploy/recorder/recorder.h"

namespace chase::recorder {

/// Every message of every channel in; logs out.
class RecorderNode : public bus::Node {
 public:
  RecorderNode(bus::Bus& bus, const RecorderConfig& config);
  int64_t TickPeriod() const override { return kTick; }
  void Tick(int64_t utime) override;
  bus::NodeReport Report() const override;

 private:
  static constexpr int64_t kTick = 200'000;  // us; a kill loses no more than this
  int64_t Lost() const;
  int64_t FreeBytes() const;

  bus::Bus& bus_;
  RecorderConfig config_;
  Recorder recorder_;
};

}  // namespace chase::recorder
