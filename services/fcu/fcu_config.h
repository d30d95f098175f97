#pragma once

#include <Eigen/Core>
#include <string>

namespace chase::fcu {

struct FcuConfig {
  std::string link = "udp";
  int port = 14540;
  int baud = 921600;
  int autopilot_system = 0;
  int system = 0;
  int component = 191;
  std::string engage = "setpoints";
  double setpoint_rate = 100.0;  ///< Hz
  double odometry_rate = 40.0;   ///< Hz
  double imu_rate = 200.0;       ///< Hz
  double hover_thrust = 0.5;
  double motor_curve = 0.0;
  bool body_rates = false;
  Eigen::Vector3d attitude_gain = {6.5, 6.5, 2.8};  ///< 1/s, frame B
  double max_rate = 3.8;                            ///< rad/s
  double setpoint_age = 0.1;                        ///< s
  double attitude_gate_deg = 10.0;
  double give_up_after = 30.0;     ///< s
  double autopilot_silence = 3.0;  ///< s
  std::string signing_key_file;
  int signing_link = 1;

  template <class V>
  void Visit(V& v) {
    v("link", link, "udp, or a serial device such as /dev/ttyAMA0");
    v("port", port, "UDP port on which the autopilot sends");
    v("baud", baud, "of the serial device, 1/s");
    v("autopilot_system", autopilot_system, "its MAVLink system; 0: the first PX4 that is heard");
    v("system", system, "our own MAVLink system; 0: the autopilot's");
    v("component", component, "our own MAVLink component; 191: onboard computer");
    v("engage", engage,
      "who switches to OFFBOARD and arms: setpoints (the first setpoints of a flight do) or pilot");
    v("setpoint_rate", setpoint_rate, "of SET_ATTITUDE_TARGET, Hz");
    v("odometry_rate", odometry_rate, "of ODOMETRY, at most, Hz");
    v("imu_rate", imu_rate, "of HIGHRES_IMU asked for, Hz");
    v("hover_thrust", hover_thrust, "share of full thrust that hovers: MPC_THR_HOVER");
    v("motor_curve", motor_curve, "quadratic share of thrust over command that PX4 leaves: 0 to 1");
    v("body_rates", body_rates, "send rates and close the attitude loop here");
    v("attitude_gain", attitude_gain, "of that loop, roll pitch yaw, 1/s");
    v("max_rate", max_rate, "bound of the rates sent on each axis, rad/s");
    v("setpoint_age", setpoint_age, "a setpoint older than this is never sent, s");
    v("attitude_gate_deg", attitude_gate_deg,
      "no flight begins while the autopilot's attitude differs from POSE by more");
    v("give_up_after", give_up_after, "of asking for a mode, for arming or for disarming, s");
    v("autopilot_silence", autopilot_silence, "without a heartbeat after which there is none, s");
    v("signing_key_file", signing_key_file, "file of 64 hexadecimal digits; empty: not signed");
    v("signing_link", signing_link, "of our own signatures");
  }

  bool engages() const { return engage == "setpoints"; }
  /// Names the field, its value and the limit; empty when all is well.
  std::string Problem() const;
};

}  // namespace chase::fcu
