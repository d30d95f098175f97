#pragma once

#include <string>

namespace chase::lidar {

struct LidarConfig {
  std::string source = "udp";      ///< "udp", a .pcap capture or a file of raw 1206-byte packets
  int port = 2368;                 ///< UDP port of the data packets
  std::string clock = "arrival";   ///< or gps
  int position_port = 8308;        ///< UDP port of the position packets
  double cut_azimuth_deg = 180.0;  ///< where a sweep begins, clockwise from forward; see Visit
  double min_range = 0.3;          ///< m
  double max_range = 130.0;        ///< m

  template <class V>
  void Visit(V& v) {
    v("source", source, "udp, a .pcap capture or a file of raw 1206-byte packets");
    v("port", port, "UDP port of the data packets, also inside captures");
    v("clock", clock,
      "arrival: stamps by the smallest delay; gps: the sensor's, locked to a pulse per second");
    v("position_port", position_port, "UDP port of the position packets, for the clock gps");
    v("cut_azimuth_deg", cut_azimuth_deg,
      "azimuth at which a sweep begins, clockwise from forward; negative: that of the first "
      "packet");
    v("min_range", min_range, "nearer returns are left out, m");
    v("max_range", max_range, "farther returns are left out, m");
  }

  /// Names the field, its value and the limit; empty when all is well.
  std::string Problem() const;
};

}  // namespace chase::lidar
