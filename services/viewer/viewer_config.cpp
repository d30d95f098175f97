#include "services/viewer/viewer_config.h"

namespace chase::viewer {
namespace {

std::string Outside(const char* name, double value, const char* limits) {
  return std::string(name) + " " + std::to_string(value) + " is not in " + limits;
}

}  // namespace

std::string ViewerConfig::Problem() const {
  if (address.empty()) return "address is empty; name one, such as 0.0.0.0";
  if (port < 0 || port > 65535) return Outside("port", port, "0..65535");
  if (!token.empty() && token.size() < 8)
    return "token has " + std::to_string(token.size()) + " characters, fewer than 8";
  if (max_clients < 1 || max_clients > 1000) return Outside("max_clients", max_clients, "1..1000");
  if (cloud_points < 1 || cloud_points > 100000)
    return Outside("cloud_points", cloud_points, "1..100000");
  if (!(cloud_rate_hz > 0.0 && cloud_rate_hz <= 10.0))
    return Outside("cloud_rate_hz", cloud_rate_hz, "(0, 10]");
  if (!(image_rate_hz > 0.0 && image_rate_hz <= 10.0))
    return Outside("image_rate_hz", image_rate_hz, "(0, 10]");
  if (jpeg_quality < 1 || jpeg_quality > 100)
    return Outside("jpeg_quality", jpeg_quality, "1..100");
  if (!(trail >= 1.0 && trail <= 60.0)) return Outside("trail", trail, "[1, 60]");
  return rig.LensProblem();
}

}  // namespace chase::viewer
