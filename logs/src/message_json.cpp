#include "logs/src/message_json.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

namespace chase::logs {
namespace {

using Json = nlohmann::ordered_json;

std::string Base64(const Bytes& bytes) {
  static const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (size_t i = 0; i < bytes.size(); i += 3) {
    const size_t left = std::min<size_t>(3, bytes.size() - i);
    uint32_t group = 0;
    for (size_t k = 0; k < 3; ++k) group = group << 8 | (k < left ? bytes[i + k] : 0u);
    for (size_t k = 0; k < 4; ++k) out += k <= left ? kDigits[(group >> (18 - 6 * k)) & 63] : '=';
  }
  return out;
}

class Builder {
 public:
  template <class T>
  void operator()(const char* name, const T& value) {
    json_[name] = Value(value);
  }
  Json Take() { return std::move(json_); }

 private:
  template <class T>
  static Json Value(const T& value) {
    if constexpr (std::is_floating_point_v<T>) {
      return std::isfinite(value) ? Json(value) : Json();
    } else if constexpr (std::is_integral_v<T>) {
      return Json(value);
    } else {
      Builder inner;
      VisitFields(value, inner);
      return inner.Take();
    }
  }
  static Json Value(const std::string& value) { return value; }
  static Json Value(const Bytes& value) { return Base64(value); }
  template <class T, size_t N>
  static Json Value(const T (&values)[N]) {
    Json out = Json::array();
    for (const T& v : values) out.push_back(Value(v));
    return out;
  }
  template <class T>
  static Json Value(const std::vector<T>& values) {
    Json out = Json::array();
    for (const T& v : values) out.push_back(Value(v));
    return out;
  }

  Json json_ = Json::object();
};

Json Timestamp(int64_t utime) {
  return {{"sec", utime / 1000000}, {"nsec", utime % 1000000 * 1000}};
}

Json IdentityPose() {
  return {{"position", {{"x", 0}, {"y", 0}, {"z", 0}}},
          {"orientation", {{"x", 0}, {"y", 0}, {"z", 0}, {"w", 1}}}};
}

/// x y z as float32, then intensity and ring as bytes.
template <class Cloud>
Json CloudJson(const Cloud& m, const char* frame) {
  constexpr size_t kStride = 14;
  constexpr int kUint8 = 1, kFloat32 = 7;  // foxglove.PackedElementField's numbers
  Bytes data(kStride * m.x.size());
  for (size_t i = 0; i < m.x.size(); ++i) {
    const float xyz[3] = {m.x[i], m.y[i], m.z[i]};
    std::memcpy(data.data() + kStride * i, xyz, sizeof xyz);
    data[kStride * i + 12] = m.intensity[i];
    data[kStride * i + 13] = m.ring[i];
  }
  Json fields = Json::array();
  int offset = 0;
  for (const char* name : {"x", "y", "z"}) {
    fields.push_back({{"name", name}, {"offset", offset}, {"type", kFloat32}});
    offset += 4;
  }
  for (const char* name : {"intensity", "ring"})
    fields.push_back({{"name", name}, {"offset", offset++}, {"type", kUint8}});
  return {{"timestamp", Timestamp(m.utime)}, {"frame_id", frame}, {"pose", IdentityPose()},
          {"point_stride", kStride},         {"fields", fields},  {"data", Base64(data)}};
}

ViewerMessage Convert(const lidar_scan_t& m) {
  return {"foxglove.PointCloud", CloudJson(m, "lidar")};
}

ViewerMessage Convert(const scan_registered_t& m) {
  return {"foxglove.PointCloud", CloudJson(m, "world")};
}

ViewerMessage Convert(const camera_image_t& m) {
  const bool grey = m.pixelformat == camera_image_t::PIXEL_FORMAT_GRAY;
  const bool bgr = m.pixelformat == camera_image_t::PIXEL_FORMAT_BGR;
  return {"foxglove.RawImage",
          {{"timestamp", Timestamp(m.utime)},
           {"frame_id", "camera"},
           {"width", m.width},
           {"height", m.height},
           {"encoding", grey  ? "mono8"
                        : bgr ? "bgr8"
                              : "rgb8"},
           {"step", m.row_stride},
           {"data", Base64(m.data)}}};
}

template <class T>
ViewerMessage Convert(const T& m) {
  Builder builder;
  VisitFields(m, builder);
  return {std::string("chase.") + T::getTypeName(), builder.Take()};
}

}  // namespace

std::optional<ViewerMessage> ToViewer(const Bytes& bytes) {
  std::optional<ViewerMessage> out;
  WithMessage(bytes, [&](const auto& message) { out = Convert(message); });
  return out;
}

Json SchemaOf(const Json& example) {
  if (example.is_string()) return {{"type", "string"}};
  if (example.is_number_integer()) return {{"type", "integer"}};
  if (example.is_number() || example.is_null()) return {{"type", "number"}};
  if (example.is_array())
    return {{"type", "array"}, {"items", example.empty() ? Json::object() : SchemaOf(example[0])}};
  Json properties = Json::object();
  for (const auto& [key, value] : example.items()) properties[key] = SchemaOf(value);
  return {{"type", "object"}, {"properties", properties}};
}

}  // namespace chase::logs
