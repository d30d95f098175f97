#pragma once

#include <string>

#include "common/world/rig.h"

namespace chase::viewer {

/// Rates and sizes keep a client below 130 kB/s, so that a link of 200 kB/s carries one: states 10
/// x 4 kB, obstacles 2 x 6 kB, sweeps 2 x 10 kB and images 4 x 8 kB a second in the gym.
struct ViewerConfig {
  std::string address = "0.0.0.0";  ///< that the server listens on; 127.0.0.1: this host only
  int port = 8080;                  ///< 0: any free one
  std::string token;                ///< that commands must carry; empty: none are taken
  int max_clients = 64;             ///< connections at a time; more are closed at once
  int cloud_points = 1500;          ///< of a sweep on the page
  double cloud_rate_hz = 2.0;
  double image_rate_hz = 4.0;
  int jpeg_quality = 60;  ///< of 100, on the page
  double trail = 60.0;    ///< s of history that a new page is told; it shows 60
  world::Rig rig;         ///< whose calibration Foxglove is told

  template <class V>
  void Visit(V& v) {
    v("address", address, "that the server listens on; 127.0.0.1: this host only");
    v("port", port, "of page and Foxglove endpoint; 0: any free one");
    v("token", token,
      "that commands must carry; empty: none are taken; rather in a file: --token-file");
    v("max_clients", max_clients, "connections at a time; more are closed at once");
    v("cloud_points", cloud_points, "of a sweep on the page");
    v("cloud_rate_hz", cloud_rate_hz, "sweeps a second on the page");
    v("image_rate_hz", image_rate_hz, "images a second on the page");
    v("jpeg_quality", jpeg_quality, "of the page's images, 1 to 100");
    v("trail", trail, "s of history that a new page is told");
    v("rig", rig, "calibration: where the sensors sit, the camera and its lens");
  }

  /// Names the field, its value and the limit; empty when all is well.
  std::string Problem() const;
};

}  // namespace chase::viewer
