#pragma once

#include <cstdint>
#include <exception>
#include <tuple>
#include <vector>

#include "common/logs/field_tables.h"

namespace chase::logs {

using Bytes = std::vector<uint8_t>;

/// The types that travel on channels.
using MessageTypes = std::tuple<attitude_setpoint_t, camera_image_t, command_ack_t, command_t,
                                event_t, flight_state_t, geofence_t, health_t, imu_t, lidar_scan_t,
                                map_t, obstacles_t, plan_t, pose_t, prediction_t, scan_registered_t,
                                scenario_t, selection_t, status_t, target_t, tracking_t, truth_t>;

/// First eight bytes of a message: what its type and fields are. 0 when there are fewer.
inline int64_t Fingerprint(const Bytes& bytes) {
  if (bytes.size() < 8) return 0;
  uint64_t fingerprint = 0;
  for (size_t i = 0; i < 8; ++i) fingerprint = fingerprint << 8 | bytes[i];
  return static_cast<int64_t>(fingerprint);
}

template <class T>
bool DecodeBytes(const Bytes& bytes, T* message) {
  try {
    const auto size = static_cast<int>(bytes.size());
    return message->decode(bytes.data(), 0, size) == size;
  } catch (const std::exception&) {  // generated decoders throw on negative lengths
    return false;
  }
}

namespace detail {

template <class T, class F>
bool CallIf(int64_t fingerprint, const Bytes& bytes, F& f) {
  if (fingerprint != T::getHash()) return false;
  T message;
  if (DecodeBytes(bytes, &message)) f(message);
  return true;
}

template <class F, class... T>
void CallFirst(const Bytes& bytes, F& f, const std::tuple<T...>*) {
  const int64_t fingerprint = Fingerprint(bytes);
  static_cast<void>((CallIf<T>(fingerprint, bytes, f) || ...));
}

}  // namespace detail

/// Calls `f(message)` with the decoded message; does nothing when the type is not ours or the bytes
/// do not decode.
template <class F>
void WithMessage(const Bytes& bytes, F f) {
  detail::CallFirst(bytes, f, static_cast<const MessageTypes*>(nullptr));
}

}  // namespace chase::logs
