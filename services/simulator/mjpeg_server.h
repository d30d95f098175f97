#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "services/simulator/camera.h"

namespace chase::simulator {

/// Serves frames as MJPEG over HTTP (multipart/x-mixed-replace) on this host, as ustreamer and
/// mjpg-streamer do: each part says in X-Timestamp when it was taken.
class MjpegServer {
 public:
  /// Throws std::runtime_error when the port cannot be had.
  MjpegServer(int port, int quality);
  ~MjpegServer();
  MjpegServer(const MjpegServer&) = delete;
  MjpegServer& operator=(const MjpegServer&) = delete;

  /// Sends a frame taken at `wall_utime` (microseconds since 1970) to every client that has taken
  /// the one before; the others miss it.
  void Send(const Image& image, int64_t wall_utime);
  /// Accepts clients and sends on what found no room.
  void Tick();

 private:
  struct Client {
    int fd;
    std::vector<uint8_t> waiting;
  };
  void Accept();
  static bool Flush(Client* client);  // false: it has gone

  int fd_, quality_;
  std::vector<Client> clients_;
};

}  // namespace chase::simulator
