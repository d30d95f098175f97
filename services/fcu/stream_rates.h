#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "services/fcu/mavlink.h"

namespace chase::fcu {

/// Asks for messages by SET_MESSAGE_INTERVAL until they arrive at their rate.
class StreamRates {
 public:
  explicit StreamRates(double imu_rate);

  void OnMessage(uint32_t id);
  /// An answer to the last request, MAV_RESULT.
  void OnAnswer(uint8_t result);
  /// The next request where one is due, parameters 1 and 2: message and interval in microseconds.
  std::optional<mav::CommandLong> Tick(int64_t utime);
  /// The autopilot began anew: ask again.
  void Restart();

  /// Of the IMU's samples, measured, Hz.
  double imu_rate() const { return rows_[Imu()].rate; }
  /// What does not come, in words; empty: all does.
  std::string missing() const;

 private:
  struct Row {
    uint32_t id;
    const char* name;
    double wanted;  // Hz
    bool needed;    // to fly by
    int heard = 0;  // in the window
    double rate = 0;
    int refusals = 0;
    bool lacking = true;
  };
  void Measure(int64_t utime);
  /// The row of the best IMU that is not refused.
  std::size_t Imu() const;
  bool IsAskedFor(std::size_t row) const { return row >= kImus || row == Imu(); }

  static constexpr std::size_t kImus = 3;  // the first rows, the best one first

  std::vector<Row> rows_;
  std::size_t next_ = 0;              // row to look at
  std::optional<std::size_t> asked_;  // row of the last request
  int64_t window_ = 0, last_request_ = 0;
};

}  // namespace chase::fcu
