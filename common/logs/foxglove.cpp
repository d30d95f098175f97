#include "common/logs/foxglove.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "common/bus/convert.h"
#include "common/bus/image_format.h"
#include "common/logs/foxglove_scene.h"
#include "common/logs/jpeg.h"
#include "common/logs/message_types.h"
#include "common/logs/protobuf.h"
#include "lcmtypes/lcm_texts.h"

namespace chase::logs {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using Messages = std::vector<ViewerMessage>;

constexpr float kPointGrid =
    8192.0f;  // per m: a twentieth of the VLP-16's 2 mm; noise does not pack

const Schema& OurTypes() {
  static const Schema types(LcmToday());
  return types;
}

/// x y z as float32 on a grid of 0.12 mm, then intensity and ring as bytes.
template <class Cloud>
std::string CloudBytes(const Cloud& m, const char* frame) {
  constexpr size_t kStride = 14;
  constexpr int kUint8 = 1, kFloat32 = 7;  // PackedElementField's numbers
  std::string data(kStride * m.x.size(), '\0');
  for (size_t i = 0; i < m.x.size(); ++i) {
    float xyz[3] = {m.x[i], m.y[i], m.z[i]};
    for (float& v : xyz) v = std::nearbyint(v * kPointGrid) / kPointGrid;
    std::memcpy(data.data() + kStride * i, xyz, sizeof xyz);
    data[kStride * i + 12] = static_cast<char>(m.intensity[i]);
    data[kStride * i + 13] = static_cast<char>(m.ring[i]);
  }
  Proto cloud;
  cloud.Put(1, Stamp(m.utime)).Bytes(2, frame);
  cloud.Put(3, Pose(Vector3d::Zero(), Quaterniond::Identity())).Int(4, kStride);
  int offset = 0;
  for (const char* name : {"x", "y", "z", "intensity", "ring"}) {
    const bool coordinate = offset < 12;
    cloud.Put(5, Proto().Bytes(1, name).Int(2, offset).Int(3, coordinate ? kFloat32 : kUint8));
    offset += coordinate ? 4 : 1;
  }
  return cloud.Bytes(6, data).bytes();
}

std::string RawImage(const camera_image_t& m) {
  const char* encoding = m.pixelformat == camera_image_t::PIXEL_FORMAT_GRAY  ? "mono8"
                         : m.pixelformat == camera_image_t::PIXEL_FORMAT_BGR ? "bgr8"
                                                                             : "rgb8";
  return Proto()
      .Put(1, Stamp(m.utime))
      .Int(2, m.width)
      .Int(3, m.height)
      .Bytes(4, encoding)
      .Int(5, m.row_stride)
      .Bytes(6, std::string(m.data.begin(), m.data.end()))
      .Bytes(7, "camera")
      .bytes();
}

std::string CompressedImage(const camera_image_t& m, const std::string& jpeg) {
  return Proto().Put(1, Stamp(m.utime)).Bytes(2, jpeg).Bytes(3, "jpeg").Bytes(4, "camera").bytes();
}

Proto& Doubles(int field, const std::vector<double>& values, Proto* out) {
  std::string bytes(values.size() * sizeof(double), '\0');
  std::memcpy(bytes.data(), values.data(), bytes.size());
  return out->Bytes(field, bytes);
}

/// Foxglove knows OpenCV's models by these names; a pinhole is a lens that bends nothing.
std::string Calibration(int64_t utime, const world::Rig& rig) {
  const double f = rig.focal_px, u = rig.center_u_px, v = rig.center_v_px;
  const bool fisheye = rig.lens == "fisheye", bends = fisheye || rig.lens == "plumb_bob";
  std::vector<double> bend(fisheye ? 4 : 5, 0.0);
  if (bends) std::copy_n(rig.lens_coefficients.data(), bend.size(), bend.begin());
  Proto out;
  out.Put(1, Stamp(utime)).Int(2, rig.width_px).Int(3, rig.height_px);
  out.Bytes(4, fisheye ? "kannala_brandt" : "plumb_bob");
  Doubles(5, bend, &out);
  Doubles(6, {f, 0, u, 0, f, v, 0, 0, 1}, &out);
  Doubles(7, {1, 0, 0, 0, 1, 0, 0, 0, 1}, &out);
  Doubles(8, {f, 0, u, 0, 0, f, v, 0, 0, 0, 1, 0}, &out);
  return out.Bytes(9, "camera").bytes();
}

std::string PoseInWorld(int64_t utime, const Vector3d& p, const Quaterniond& q) {
  return Proto().Put(1, Stamp(utime)).Bytes(2, "world").Put(3, Pose(p, q)).bytes();
}

Proto Transform(int64_t utime, const char* parent, const char* child, const Vector3d& p,
                const Quaterniond& q) {
  return Proto()
      .Put(1, Stamp(utime))
      .Bytes(2, parent)
      .Bytes(3, child)
      .Put(4, Vector(p))
      .Put(5, Rotation(q));
}

std::string Transforms(const pose_t& m, const world::Rig& rig) {
  return Proto()
      .Put(1, Transform(m.utime, "world", "body", bus::ToVector(m.pos), ToRotation(m.orientation)))
      .Put(1, Transform(m.utime, "body", "lidar", rig.lidar_position, Quaterniond(rig.R_BL())))
      .Put(1, Transform(m.utime, "body", "camera", rig.camera_position, Quaterniond(rig.R_BC())))
      .bytes();
}

std::string LogLine(int64_t utime, int level, const std::string& text, const std::string& name) {
  return Proto().Put(1, Stamp(utime)).Int(2, level).Bytes(3, text).Bytes(4, name).bytes();
}

std::string LogLine(const status_t& m) {
  constexpr int kInfo = 2, kWarning = 3, kError = 4;
  const int level = m.state == status_t::FAILED ? kError
                    : m.state == status_t::OK   ? kInfo
                                                : kWarning;
  return LogLine(m.utime, level, m.last_error.empty() ? m.detail : m.detail + "; " + m.last_error,
                 m.name);
}

std::string LogLine(const event_t& m) {
  constexpr int kWarning = 3;
  const std::string text = m.name + (m.phase == event_t::BEGINS ? " begins" : " ends");
  return LogLine(m.utime, kWarning, text, m.sender);
}

template <class T, class... Any>
constexpr bool kIs = (std::is_same_v<T, Any> || ...);

double HardRadius(const ViewerOptions& options, const std::string& vehicle) {
  const auto known = options.hard_radius.find(vehicle);
  return known == options.hard_radius.end() ? 0.0 : known->second;
}

/// What Foxglove draws of a message, besides its fields.
template <class T>
void AddDrawn(const T& m, const std::string& channel, const ViewerOptions& options, Messages* out) {
  if constexpr (kIs<T, pose_t, truth_t>)
    out->push_back({channel + "/pose", "foxglove.PoseInFrame",
                    PoseInWorld(m.utime, bus::ToVector(m.pos), ToRotation(m.orientation))});
  if constexpr (kIs<T, pose_t>)
    out->push_back({"/tf", "foxglove.FrameTransforms", Transforms(m, options.rig)});
  if constexpr (kIs<T, obstacles_t, target_t, plan_t, prediction_t, geofence_t>)
    out->push_back({channel + "/scene", "foxglove.SceneUpdate", SceneOf(m)});
  if constexpr (kIs<T, obstacles_t>)
    out->push_back({channel + "/grown", "foxglove.SceneUpdate",
                    GrownSceneOf(m, HardRadius(options, m.vehicle))});
  if constexpr (kIs<T, status_t, event_t>)
    out->push_back({channel + "/log", "foxglove.Log", LogLine(m)});
}

template <class T>
void Add(const T& m, const LogEvent& e, const ViewerOptions& options, Messages* out) {
  const Struct& type = *OurTypes().Find(T::getTypeName());
  const std::string body(e.bytes.begin() + 8, e.bytes.end());  // behind the fingerprint
  out->push_back({e.channel, std::string("chase.") + T::getTypeName(),
                  ToProto(OurTypes(), type, Decode(OurTypes(), type, body)).bytes()});
  AddDrawn(m, e.channel, options, out);
}
void Add(const lidar_scan_t& m, const LogEvent& e, const ViewerOptions&, Messages* out) {
  out->push_back({e.channel, "foxglove.PointCloud", CloudBytes(m, "lidar")});
}
void Add(const scan_registered_t& m, const LogEvent& e, const ViewerOptions&, Messages* out) {
  out->push_back({e.channel, "foxglove.PointCloud", CloudBytes(m, "world")});
}
void Add(const camera_image_t& m, const LogEvent& e, const ViewerOptions& options, Messages* out) {
  const bool raw = !options.jpeg && m.pixelformat != bus::kPixelFormatMjpeg;
  const std::string jpeg = raw ? "" : Jpeg(m);
  if (raw)
    out->push_back({e.channel, "foxglove.RawImage", RawImage(m)});
  else if (!jpeg.empty())
    out->push_back({e.channel, "foxglove.CompressedImage", CompressedImage(m, jpeg)});
  out->push_back({e.channel + "/calibration", "foxglove.CameraCalibration",
                  Calibration(m.utime, options.rig)});
}

}  // namespace

std::vector<ViewerMessage> ToViewer(const LogEvent& event, const ViewerOptions& options) {
  Messages out;
  WithMessage(event.bytes, [&](const auto& m) { Add(m, event, options, &out); });
  return out;
}

std::string DescriptorsOf(const std::string& schema) {
  const size_t dot = schema.find('.');
  const std::string package = schema.substr(0, dot);
  const Schema& types = package == "chase" ? OurTypes() : FoxgloveTypes();
  return Descriptors(types, *types.Find(schema.substr(dot + 1)), package);
}

}  // namespace chase::logs
