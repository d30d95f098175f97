#include "common/logs/foxglove.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <cstring>

#include "common/bus/convert.h"
#include "common/bus/image_format.h"
#include "common/logs/jpeg.h"
#include "common/logs/message_types.h"
#include "common/logs/protobuf.h"
#include "common/world/rig.h"
#include "lcmtypes/lcm_texts.h"

namespace chase::logs {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;
using Messages = std::vector<ViewerMessage>;

constexpr int kCurvePoints = 25;  // 0.1 s of a horizon of 2.5 s
constexpr float kPointGrid =
    8192.0f;                         // per m: a twentieth of the VLP-16's 2 mm; noise does not pack
constexpr double kThickness = 0.04;  // of a curve, m

struct Tint {
  double r, g, b, a;
};
constexpr Tint kStill = {0.55, 0.57, 0.6, 0.5}, kMoving = {0.8, 0.2, 0.2, 0.6},
               kGround = {0.5, 0.45, 0.35, 0.3}, kTarget = {0.91, 0.44, 0.04, 0.9},
               kPlan = {0.12, 0.37, 0.66, 1.0}, kForecast = {0.91, 0.44, 0.04, 1.0};

const Schema& OurTypes() {
  static const Schema types(LcmToday());
  return types;
}

Proto Stamp(int64_t utime) {
  return Proto().Int(1, utime / 1000000).Int(2, utime % 1000000 * 1000);
}
Proto Vector(const Vector3d& v) {
  return Proto().Double(1, v.x()).Double(2, v.y()).Double(3, v.z());
}
Proto Rotation(const Quaterniond& q) {
  return Proto().Double(1, q.x()).Double(2, q.y()).Double(3, q.z()).Double(4, q.w());
}
Proto Pose(const Vector3d& p, const Quaterniond& q) {
  return Proto().Put(1, Vector(p)).Put(2, Rotation(q));
}
Proto Color(const Tint& t) {
  return Proto().Double(1, t.r).Double(2, t.g).Double(3, t.b).Double(4, t.a);
}
Quaterniond ToRotation(const double (&q)[4]) { return {q[0], q[1], q[2], q[3]}; }

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

/// Of the rig that flies by default: a log does not hold another.
std::string Calibration(int64_t utime) {
  const world::Rig rig;
  const double f = rig.focal_px, u = rig.center_u_px, v = rig.center_v_px;
  Proto out;
  out.Put(1, Stamp(utime)).Int(2, rig.width_px).Int(3, rig.height_px).Bytes(4, "plumb_bob");
  Doubles(5, {0, 0, 0, 0, 0}, &out);
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

std::string Transforms(const pose_t& m) {
  const world::Rig rig;
  return Proto()
      .Put(1, Transform(m.utime, "world", "body", bus::ToVector(m.pos), ToRotation(m.orientation)))
      .Put(1, Transform(m.utime, "body", "lidar", rig.lidar_position, Quaterniond(rig.R_BL())))
      .Put(1, Transform(m.utime, "body", "camera", rig.camera_position, Quaterniond(rig.R_BC())))
      .bytes();
}

// SceneEntity's numbers of the primitives.
enum Primitive { kCube = 8, kSphere = 9, kCylinder = 10, kLine = 11 };

/// The entity that all earlier ones of this name give way to.
Proto Entity(int64_t utime, const char* name) {
  return Proto().Put(1, Stamp(utime)).Bytes(2, "world").Bytes(3, name).Put(4, Proto());
}

std::string Scene(const Proto& entity) { return Proto().Put(2, entity).bytes(); }

Proto Solid(Primitive kind, const Proto& pose, const Vector3d& size, const Tint& tint) {
  Proto solid;
  solid.Put(1, pose).Put(2, Vector(size));
  if (kind == kCylinder) solid.Double(3, 1.0).Double(4, 1.0);
  return solid.Put(kind == kCylinder ? 5 : 3, Color(tint));
}

Proto Curve(const polynomial_t& m, const Tint& tint) {
  const world::Trajectory path = bus::FromMessage(m, m.utime);
  Proto line;
  line.Int(1, 0).Put(2, Pose(Vector3d::Zero(), Quaterniond::Identity())).Double(3, kThickness);
  for (int i = 0; i <= kCurvePoints; ++i)
    line.Put(5, Vector(path.Position(path.start + path.duration * i / kCurvePoints)));
  return line.Put(6, Color(tint));
}

/// { x : x' R x <= 1 } has half axes 1 / sqrt(eigenvalue) along the eigenvectors.
void AddEllipsoid(const world::Obstacle& o, const Vector3d& center, const Tint& tint,
                  Proto* entity) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(o.shape);
  Eigen::Matrix3d R = axes.eigenvectors();
  if (R.determinant() < 0.0) R.col(0) *= -1.0;
  const Vector3d size = 2.0 * axes.eigenvalues().cwiseMax(1e-9).cwiseSqrt().cwiseInverse();
  entity->Put(kSphere, Solid(kSphere, Pose(center, Quaterniond(R)), size, tint));
}

std::string ObstacleScene(const obstacles_t& m) {
  Proto entity = Entity(m.utime, "obstacles");
  for (const obstacle_t& o : m.obstacles) {
    const Tint& tint = o.kind == obstacle_t::MOVING   ? kMoving
                       : o.kind == obstacle_t::GROUND ? kGround
                                                      : kStill;
    const world::Obstacle obstacle = bus::FromMessage(o, m.utime);
    const Vector3d center = obstacle.center.Position(0.0);
    const Vector3d size = 2.0 * bus::ToVector(o.half);
    const Quaterniond q = ToRotation(o.orientation);
    if (o.solid == obstacle_t::BOX)
      entity.Put(kCube, Solid(kCube, Pose(center, q), size, tint));
    else if (o.solid == obstacle_t::CYLINDER)
      entity.Put(kCylinder, Solid(kCylinder, Pose(center, Quaterniond::Identity()), size, tint));
    else
      AddEllipsoid(obstacle, center, tint, &entity);
  }
  return Scene(entity);
}

std::string TargetScene(const target_t& m) {
  Proto entity = Entity(m.utime, "target");
  if (m.state == target_t::TRACKING || m.state == target_t::OCCLUDED)
    entity.Put(kCylinder, Solid(kCylinder, Pose(bus::ToVector(m.mean), Quaterniond::Identity()),
                                {2 * m.radius, 2 * m.radius, m.height}, kTarget));
  return Scene(entity);
}

std::string CurveScene(int64_t utime, const char* name, const polynomial_t& path,
                       const Tint& tint) {
  Proto entity = Entity(utime, name);
  if (path.n_coefficients > 0) entity.Put(kLine, Curve(path, tint));
  return Scene(entity);
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

/// What Foxglove draws of a message, besides its fields.
template <class T>
void AddDrawn(const T&, const std::string&, Messages*) {}
void AddDrawn(const pose_t& m, const std::string& channel, Messages* out) {
  out->push_back({channel + "/pose", "foxglove.PoseInFrame",
                  PoseInWorld(m.utime, bus::ToVector(m.pos), ToRotation(m.orientation))});
  out->push_back({"/tf", "foxglove.FrameTransforms", Transforms(m)});
}
void AddDrawn(const truth_t& m, const std::string& channel, Messages* out) {
  out->push_back({channel + "/pose", "foxglove.PoseInFrame",
                  PoseInWorld(m.utime, bus::ToVector(m.pos), ToRotation(m.orientation))});
}
void AddDrawn(const obstacles_t& m, const std::string& channel, Messages* out) {
  out->push_back({channel + "/scene", "foxglove.SceneUpdate", ObstacleScene(m)});
}
void AddDrawn(const target_t& m, const std::string& channel, Messages* out) {
  out->push_back({channel + "/scene", "foxglove.SceneUpdate", TargetScene(m)});
}
void AddDrawn(const plan_t& m, const std::string& channel, Messages* out) {
  out->push_back(
      {channel + "/scene", "foxglove.SceneUpdate", CurveScene(m.utime, "plan", m.position, kPlan)});
}
void AddDrawn(const prediction_t& m, const std::string& channel, Messages* out) {
  out->push_back({channel + "/scene", "foxglove.SceneUpdate",
                  CurveScene(m.utime, "prediction", m.target, kForecast)});
}
void AddDrawn(const status_t& m, const std::string& channel, Messages* out) {
  out->push_back({channel + "/log", "foxglove.Log", LogLine(m)});
}
void AddDrawn(const event_t& m, const std::string& channel, Messages* out) {
  constexpr int kWarning = 3;
  const std::string text = m.name + (m.phase == event_t::BEGINS ? " begins" : " ends");
  out->push_back({channel + "/log", "foxglove.Log", LogLine(m.utime, kWarning, text, m.sender)});
}

template <class T>
void Add(const T& m, const LogEvent& e, const ViewerOptions&, Messages* out) {
  const Struct& type = *OurTypes().Find(T::getTypeName());
  const std::string body(e.bytes.begin() + 8, e.bytes.end());  // behind the fingerprint
  out->push_back({e.channel, std::string("chase.") + T::getTypeName(),
                  ToProto(OurTypes(), type, Decode(OurTypes(), type, body)).bytes()});
  AddDrawn(m, e.channel, out);
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
  out->push_back({e.channel + "/calibration", "foxglove.CameraCalibration", Calibration(m.utime)});
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
