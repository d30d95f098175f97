#include "services/simulator/mjpeg_server.h"

#include <fmt/format.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <stdexcept>

namespace chase::simulator {
namespace {

constexpr char kHeader[] =
    "HTTP/1.0 200 OK\r\nServer: chase-simulator\r\nCache-Control: no-store\r\n"
    "Content-Type: multipart/x-mixed-replace;boundary=chase-frame\r\n\r\n";

std::vector<uint8_t> Jpeg(const Image& image, int quality) {
  const cv::Mat rgb(image.height, image.width, CV_8UC3, const_cast<uint8_t*>(image.rgb.data()));
  cv::Mat bgr;
  cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
  std::vector<uint8_t> jpeg;
  cv::imencode(".jpg", bgr, jpeg, {cv::IMWRITE_JPEG_QUALITY, quality});
  return jpeg;
}

}  // namespace

MjpegServer::MjpegServer(int port, int quality)
    : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0)), quality_(quality) {
  const int yes = 1;
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (fd_ >= 0 && setsockopt(fd_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes) == 0 &&
      bind(fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0 &&
      listen(fd_, 4) == 0)
    return;
  const std::string why = std::strerror(errno);
  if (fd_ >= 0) close(fd_);
  throw std::runtime_error(fmt::format(
      "TCP port {}: {}; stop the program that holds it or set hardware.camera_port", port, why));
}

MjpegServer::~MjpegServer() {
  for (const Client& client : clients_) close(client.fd);
  close(fd_);
}

/// What a client asks for is passed over: there is one stream.
void MjpegServer::Accept() {
  for (int fd = 0; (fd = accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK)) >= 0;)
    clients_.push_back({fd, {std::begin(kHeader), std::end(kHeader) - 1}});
}

bool MjpegServer::Flush(Client* client) {
  uint8_t request[1024];
  const ssize_t heard = recv(client->fd, request, sizeof request, 0);
  if (heard == 0 || (heard < 0 && errno != EAGAIN)) return false;
  auto& waiting = client->waiting;
  if (waiting.empty()) return true;
  const ssize_t sent = send(client->fd, waiting.data(), waiting.size(), MSG_NOSIGNAL);
  if (sent < 0) return errno == EAGAIN;
  waiting.erase(waiting.begin(), waiting.begin() + sent);
  return true;
}

void MjpegServer::Tick() {
  Accept();
  const auto gone = [](Client& client) {
    if (Flush(&client)) return false;
    close(client.fd);
    return true;
  };
  clients_.erase(std::remove_if(clients_.begin(), clients_.end(), gone), clients_.end());
}

void MjpegServer::Send(const Image& image, int64_t wall_utime) {
  Accept();
  if (!clients_.empty()) {
    const std::vector<uint8_t> jpeg = Jpeg(image, quality_);
    const std::string head = fmt::format(
        "--chase-frame\r\nContent-Type: image/jpeg\r\nContent-Length: {}\r\n"
        "X-Timestamp: {}.{:06}\r\n\r\n",
        jpeg.size(), wall_utime / 1'000'000, wall_utime % 1'000'000);
    for (Client& client : clients_) {
      if (client.waiting.size() > sizeof kHeader) continue;  // it is slow
      client.waiting.insert(client.waiting.end(), head.begin(), head.end());
      client.waiting.insert(client.waiting.end(), jpeg.begin(), jpeg.end());
      client.waiting.insert(client.waiting.end(), {'\r', '\n'});
    }
  }
  Tick();
}

}  // namespace chase::simulator
