#pragma once

#include <string>

namespace chase::simulator {

/// What the vehicle's devices speak. Drivers are in the loop where it is not LCM.
struct HardwareConfig {
  std::string fcu = "lcm";
  std::string lidar = "lcm";
  std::string camera = "lcm";
  std::string host = "127.0.0.1";
  int fcu_port = 14540, fcu_own_port = 14580;
  int lidar_port = 2368, position_port = 8308;
  std::string lidar_clock = "own";
  int camera_port = 8090;
  int jpeg_quality = 90;

  template <class V>
  void Visit(V& v) {
    v("fcu", fcu, "lcm (setpoints in, IMU out) or mavlink (PX4 over UDP)");
    v("lidar", lidar, "lcm or udp (VLP-16 data packets)");
    v("camera", camera, "lcm or mjpeg (a stream over HTTP)");
    v("host", host, "address to which autopilot and LiDAR send");
    v("fcu_port", fcu_port, "UDP port on which the companion listens");
    v("fcu_own_port", fcu_own_port, "UDP port on which the autopilot listens");
    v("lidar_port", lidar_port, "UDP port of the data packets");
    v("position_port", position_port, "UDP port of the position packets");
    v("lidar_clock", lidar_clock, "own (since its power-on) or gps (UTC, by a pulse per second)");
    v("camera_port", camera_port, "TCP port on which the camera serves http://HOST:PORT/stream");
    v("jpeg_quality", jpeg_quality, "of the camera's stream, 1 to 100");
  }
  std::string Problem() const;

  bool mavlink() const { return fcu == "mavlink"; }
  bool packets() const { return lidar == "udp"; }
  bool stream() const { return camera == "mjpeg"; }
  bool any() const { return mavlink() || packets() || stream(); }
};

/// Where the camera's stream is to be had.
std::string StreamUrl(const HardwareConfig& config);

}  // namespace chase::simulator
