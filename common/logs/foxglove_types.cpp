#include "common/logs/foxglove.h"

namespace chase::logs {
namespace {

constexpr const char* kTypes = R"(
struct Timestamp { int64_t seconds; int32_t nanos; }
struct Duration { int64_t seconds; int32_t nanos; }
struct Vector3 { double x; double y; double z; }
struct Point3 { double x; double y; double z; }
struct Quaternion { double x; double y; double z; double w; }
struct Pose { Vector3 position; Quaternion orientation; }
struct Color { double r; double g; double b; double a; }
struct PackedElementField { string name; int32_t offset; int32_t type; }
struct PointCloud {
  int32_t n;
  Timestamp timestamp; string frame_id; Pose pose; int32_t point_stride;
  PackedElementField fields[n]; byte data[n];
}
struct RawImage {
  int32_t n;
  Timestamp timestamp; int32_t width; int32_t height; string encoding; int32_t step; byte data[n];
  string frame_id;
}
struct CompressedImage {
  int32_t n;
  Timestamp timestamp; byte data[n]; string format; string frame_id;
}
struct CameraCalibration {
  int32_t n;
  Timestamp timestamp; int32_t width; int32_t height; string distortion_model;
  double D[n]; double K[9]; double R[9]; double P[12]; string frame_id;
}
struct PoseInFrame { Timestamp timestamp; string frame_id; Pose pose; }
struct FrameTransform {
  Timestamp timestamp; string parent_frame_id; string child_frame_id;
  Vector3 translation; Quaternion rotation;
}
struct FrameTransforms { int32_t n; FrameTransform transforms[n]; }
struct Log {
  Timestamp timestamp; int32_t level; string message; string name; string file; int32_t line;
}
struct KeyValuePair { string key; string value; }
struct ArrowPrimitive {
  Pose pose; double shaft_length; double shaft_diameter; double head_length; double head_diameter;
  Color color;
}
struct CubePrimitive { Pose pose; Vector3 size; Color color; }
struct SpherePrimitive { Pose pose; Vector3 size; Color color; }
struct CylinderPrimitive {
  Pose pose; Vector3 size; double bottom_scale; double top_scale; Color color;
}
struct LinePrimitive {
  int32_t n;
  int32_t type; Pose pose; double thickness; boolean scale_invariant;
  Point3 points[n]; Color color; Color colors[n]; int32_t indices[n];
}
struct TriangleListPrimitive {
  int32_t n;
  Pose pose; Point3 points[n]; Color color; Color colors[n]; int32_t indices[n];
}
struct TextPrimitive {
  Pose pose; boolean billboard; double font_size; boolean scale_invariant; Color color; string text;
}
struct ModelPrimitive {
  int32_t n;
  Pose pose; Vector3 scale; Color color; boolean override_color; string url; string media_type;
  byte data[n];
}
struct SceneEntityDeletion { Timestamp timestamp; int32_t type; string id; }
struct SceneEntity {
  int32_t n;
  Timestamp timestamp; string frame_id; string id; Duration lifetime; boolean frame_locked;
  KeyValuePair metadata[n]; ArrowPrimitive arrows[n]; CubePrimitive cubes[n];
  SpherePrimitive spheres[n]; CylinderPrimitive cylinders[n]; LinePrimitive lines[n];
  TriangleListPrimitive triangles[n]; TextPrimitive texts[n]; ModelPrimitive models[n];
}
struct SceneUpdate { int32_t n; SceneEntityDeletion deletions[n]; SceneEntity entities[n]; }
)";

}  // namespace

const Schema& FoxgloveTypes() {
  static const Schema types(kTypes);
  return types;
}

}  // namespace chase::logs
