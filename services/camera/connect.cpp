#include "services/camera/connect.h"

#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

namespace chase::camera {

int ConnectToAny(const addrinfo* addresses, int patience_ms, std::string* why) {
  const timeval patience{patience_ms / 1000, 1000 * (patience_ms % 1000)};  // connecting as well
  for (const addrinfo* to = addresses; to != nullptr; to = to->ai_next) {
    const int fd = socket(to->ai_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
    if (fd >= 0) {
      setsockopt(fd, SOL_SOCKET, SO_SNDTIMEO, &patience, sizeof patience);
      if (connect(fd, to->ai_addr, to->ai_addrlen) == 0) return fd;
    }
    const int error = errno;
    *why = std::strerror(error == EINPROGRESS ? ETIMEDOUT : error);
    if (fd >= 0) close(fd);
  }
  return -1;
}

}  // namespace chase::camera
