#include "services/fcu/stream_rates.h"

#include <fmt/format.h>

namespace chase::fcu {
namespace {

constexpr int64_t kWindow = 2'000'000;  // over which rates are measured, us
constexpr int64_t kBetween = 200'000;   // requests: one is answered before the next, us
constexpr double kEnough = 0.6;         // of the wanted rate: PX4 scales rates on a slow link
constexpr int kMostRefusals = 3;        // then the autopilot does not have the message

template <class M>
constexpr uint32_t Id() {
  return M::kId;
}

}  // namespace

// What the bridge needs of each. PX4's own rates for a companion are lower or depend on the link.
// TIMESYNC: it counts 500 answers before it believes our stamps, 50 s at its own 10 Hz.
StreamRates::StreamRates(double imu_rate)
    : rows_{{Id<mav::HighresImu>(), "HIGHRES_IMU", imu_rate, true},
            {Id<mav::RawImu>(), "RAW_IMU", imu_rate, true},
            {Id<mav::ScaledImu>(), "SCALED_IMU", imu_rate, true},
            {Id<mav::Timesync>(), "TIMESYNC", 100.0, false},
            {Id<mav::AttitudeQuaternion>(), "ATTITUDE_QUATERNION", 50.0, true},
            {Id<mav::LocalPositionNed>(), "LOCAL_POSITION_NED", 20.0, false},
            {Id<mav::ExtendedSysState>(), "EXTENDED_SYS_STATE", 5.0, true},
            {Id<mav::SysStatus>(), "SYS_STATUS", 1.0, false},
            {Id<mav::BatteryStatus>(), "BATTERY_STATUS", 1.0, false},
            {Id<mav::RcChannels>(), "RC_CHANNELS", 5.0, false}} {}

void StreamRates::OnMessage(uint32_t id) {
  for (Row& row : rows_)
    if (row.id == id) ++row.heard;
}

void StreamRates::OnAnswer(uint8_t result) {
  if (!asked_) return;
  const auto r = static_cast<mav::MavResult>(result);
  if (r != mav::MavResult::ACCEPTED && r != mav::MavResult::IN_PROGRESS) ++rows_[*asked_].refusals;
  asked_.reset();
}

void StreamRates::Measure(int64_t utime) {
  const double seconds = 1e-6 * static_cast<double>(utime - window_);
  for (Row& row : rows_) {
    row.rate = window_ == 0 ? 0.0 : row.heard / seconds;
    row.heard = 0;
    // Battery and receiver may be missing; what is slow anyway need only come at all.
    row.lacking = row.wanted > 1.0 ? row.rate < kEnough * row.wanted : row.rate == 0.0;
  }
  window_ = utime;
}

std::optional<mav::CommandLong> StreamRates::Tick(int64_t utime) {
  if (window_ == 0 || utime - window_ >= kWindow) Measure(utime);
  if (utime - last_request_ < kBetween) return std::nullopt;
  for (std::size_t k = 0; k < rows_.size(); ++k) {
    const std::size_t i = (next_ + k) % rows_.size();
    Row& row = rows_[i];
    if (!row.lacking || row.refusals >= kMostRefusals || !IsAskedFor(i)) continue;
    row.lacking = false;  // until it has been measured again
    next_ = i + 1;
    asked_ = i;
    last_request_ = utime;
    mav::CommandLong m;
    m.command = static_cast<uint16_t>(mav::MavCmd::SET_MESSAGE_INTERVAL);
    m.param1 = static_cast<float>(row.id);
    m.param2 = static_cast<float>(1e6 / row.wanted);
    return m;
  }
  return std::nullopt;
}

void StreamRates::Restart() {
  for (Row& row : rows_) row.refusals = 0, row.lacking = true;
  asked_.reset();
}

std::size_t StreamRates::Imu() const {
  std::size_t row = 0;
  while (row + 1 < kImus && rows_[row].refusals >= kMostRefusals) ++row;
  return row;
}

std::string StreamRates::missing() const {
  std::string words;
  for (std::size_t i = 0; i < rows_.size(); ++i)
    if (const Row& row = rows_[i]; row.needed && IsAskedFor(i) && row.rate < kEnough * row.wanted)
      words += fmt::format("{}{} at {:.1f} of {:.0f} Hz{}", words.empty() ? "" : ", ", row.name,
                           row.rate, row.wanted, row.refusals >= kMostRefusals ? " (refused)" : "");
  return words;
}

}  // namespace chase::fcu
