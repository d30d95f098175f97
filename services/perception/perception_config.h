#pragma once

#include <Eigen/Core>
#include <cmath>
#include <sstream>
#include <string>
#include <type_traits>

#include "common/world/rig.h"

namespace chase::perception {

/// Visits a config's fields for the first one that is no number, or lies outside its limits as
/// Limited() gives them.
struct LimitCheck {
  std::string problem;

  template <class T>
  void operator()(const char* name, T& field, const char*) {
    if constexpr (std::is_floating_point_v<T>) Finite(name, field);
    if constexpr (std::is_base_of_v<Eigen::MatrixBase<T>, T>)
      for (Eigen::Index i = 0; i < field.size(); ++i)
        Finite(std::string(name) + "[" + std::to_string(i) + "]", field[i]);
  }
  void Finite(const std::string& name, double value) {
    if (problem.empty() && !std::isfinite(value))
      problem = name + " is " + std::to_string(value) + ", must be a finite number";
  }
  void Limit(const char* name, double value, double low, double high) {
    if (!problem.empty() || (value >= low && value <= high)) return;
    std::ostringstream out;
    out << name << " is " << value << ", must be " << low << " to " << high;
    problem = out.str();
  }
};

/// Visits a field with its least and greatest value.
template <class V, class T>
void Limited(V& v, const char* name, T& field, double low, double high, const char* doc) {
  if constexpr (std::is_same_v<V, LimitCheck>)
    v.Limit(name, static_cast<double>(field), low, high);
  else
    v(name, field, doc);
}

/// What a config's Problem() says of the fields that lie outside their limits.
template <class Config>
struct Limits {
  std::string Problem() const {
    LimitCheck check;
    Config(static_cast<const Config&>(*this)).Visit(check);
    return check.problem;
  }
};

/// The target's colour. A soft score: 1 inside the range, falling to 0 outside it.
struct ColorConfig : Limits<ColorConfig> {
  double hue_min_deg = 10.0, hue_max_deg = 42.0;  ///< may wrap: 350 to 20
  double saturation_min = 0.6, value_min = 0.16;
  bool white_balance = true;

  template <class V>
  void Visit(V& v) {
    Limited(v, "hue_min_deg", hue_min_deg, 0, 360,
            "0 red, 30 orange, 60 yellow; may be above hue_max_deg: wraps");
    Limited(v, "hue_max_deg", hue_max_deg, 0, 360, "upper end of the hue; 0 to 360 is every hue");
    Limited(v, "saturation_min", saturation_min, 0, 1, "0 grey to 1 pure");
    Limited(v, "value_min", value_min, 0, 1,
            "brightest channel as a share of the light on the scene, 0 to 1");
    v("white_balance", white_balance, "undo the tint of the light, estimated on greyish pixels");
  }
};

/// What the target's blob looks like in the image.
struct ShapeConfig : Limits<ShapeConfig> {
  double aspect = 0.57, fill = 0.93;
  double inset = 0.0, outline_sigma = 0.0;

  template <class V>
  void Visit(V& v) {
    Limited(v, "aspect", aspect, 0.05, 20, "width over height of the whole blob");
    Limited(v, "fill", fill, 0.05, 1, "share of its box that the blob fills");
    Limited(v, "inset", inset, 0, 0.4,
            "the target lies so far inside the colour's outline, share of its width");
    Limited(v, "outline_sigma", outline_sigma, 0, 0.5,
            "its sides depart so far from the model's, as a cone's from a cylinder's, in every "
            "frame alike: one standard deviation, share of its width");
  }
};

struct MarkerConfig : Limits<MarkerConfig> {
  std::string dictionary = "DICT_4X4_50";
  int id = 0;
  double side = 0.2, depth = 0.15;

  template <class V>
  void Visit(V& v) {
    v("dictionary", dictionary,
      "DICT_4X4_50, DICT_5X5_50, DICT_6X6_250, DICT_ARUCO_ORIGINAL, DICT_APRILTAG_16h5, "
      "DICT_APRILTAG_25h9 or DICT_APRILTAG_36h11");
    Limited(v, "id", id, -1, 10000, "the target's marker, one that the dictionary has; -1: any");
    Limited(v, "side", side, 0.01, 5, "edge of the black square, m");
    Limited(v, "depth", depth, -1, 5,
            "from the marker along the line of sight to the target's centre, m");
  }
};

struct NetworkConfig : Limits<NetworkConfig> {
  std::string file;
  int input_width_px = 320, input_height_px = 320;
  int class_id = 0;
  double min_score = 0.5;

  template <class V>
  void Visit(V& v) {
    v("file", file, "ONNX file; output rows: centre x, centre y, width, height (input px), scores");
    Limited(v, "input_width_px", input_width_px, 8, 4096, "the image is scaled to this");
    Limited(v, "input_height_px", input_height_px, 8, 4096, "the image is scaled to this");
    Limited(v, "class_id", class_id, 0, 10000, "which score is the target's");
    Limited(v, "min_score", min_score, 0, 1, "boxes below are left out, 0 to 1");
  }
};

struct DetectorConfig {
  std::string kind = "color";
  ColorConfig color;
  ShapeConfig shape;
  MarkerConfig marker;
  NetworkConfig network;

  template <class V>
  void Visit(V& v) {
    v("kind", kind, "color, marker or network");
    v("color", color, "of the target");
    v("shape", shape, "of the target's blob");
    v("marker", marker, "for kind marker");
    v("network", network, "for kind network");
  }
  std::string Problem() const;
};

/// Standard deviations of what is measured.
struct FitConfig : Limits<FitConfig> {
  double edge_sigma_px = 0.5, lidar_sigma = 0.025;

  template <class V>
  void Visit(V& v) {
    Limited(v, "edge_sigma_px", edge_sigma_px, 0.05, 20,
            "of one edge of the silhouette where the image is sharp; more where it is blurred");
    Limited(v, "lidar_sigma", lidar_sigma, 1e-3, 1, "of one LiDAR point, m");
  }
};

/// Constant velocity with white acceleration, and the honesty of what is published.
struct MotionConfig : Limits<MotionConfig> {
  double acceleration_density = 0.12, max_speed = 5.0;
  double pose_sigma = 0.005, tilt_sigma_deg = 0.35, heading_sigma_deg = 0.12;

  template <class V>
  void Visit(V& v) {
    Limited(v, "acceleration_density", acceleration_density, 1e-4, 100,
            "of horizontal acceleration, m^2/s^3");
    Limited(v, "max_speed", max_speed, 0.1, 50,
            "a target found again lies where this speed reaches, m/s");
    Limited(v, "pose_sigma", pose_sigma, 0, 1,
            "least standard deviation of the drone's position, m");
    Limited(v, "tilt_sigma_deg", tilt_sigma_deg, 0, 20,
            "least standard deviation of its roll and pitch");
    Limited(v, "heading_sigma_deg", heading_sigma_deg, 0, 20,
            "least standard deviation of its heading");
  }
};

/// When the target counts as found and lost.
struct StateConfig : Limits<StateConfig> {
  double acquire_score = 0.35, lost_after = 5.0, standing_after = 3.0, decoy_radius = 0.5;

  template <class V>
  void Visit(V& v) {
    Limited(v, "acquire_score", acquire_score, 0, 1,
            "least score of a detection that starts a track, 0 to 1");
    Limited(v, "lost_after", lost_after, 0.08, 60, "unseen for longer: lost, s");
    Limited(v, "standing_after", standing_after, 0, 60,
            "what stands is taken for the target after so long, beyond 5 m later, s");
    Limited(v, "decoy_radius", decoy_radius, 0.05, 10,
            "what is seen nearer than this to a look-alike, a candidate, the target in view or "
            "where a hidden one is expected or stood, is taken for that, m");
  }
};

struct PerceptionConfig : Limits<PerceptionConfig> {
  world::Rig rig;
  std::string target_shape = "cylinder";
  double target_radius = 0.15, target_height = 0.5;
  DetectorConfig detector;
  FitConfig fit;
  MotionConfig motion;
  StateConfig state;

  template <class V>
  void Visit(V& v) {
    v("rig", rig, "calibration: where the sensors sit, the pinhole camera");
    v("target_shape", target_shape, "cylinder (upright), box (upright, its base square) or sphere");
    Limited(v, "target_radius", target_radius, 0.01, 5,
            "of the target; half the width of a box, m");
    Limited(v, "target_height", target_height, 0.02, 10, "of the target, m");
    v("detector", detector, "finds the target in the image");
    v("fit", fit, "places it in space");
    v("motion", motion, "how it may move, what is sent out");
    v("state", state, "found, hidden, lost");
  }
  std::string Problem() const;
};

}  // namespace chase::perception
