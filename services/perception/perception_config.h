#pragma once

#include <string>

#include "common/world/rig.h"

namespace chase::perception {

/// The target's colour. A soft score: 1 inside the range, falling to 0 over `softness` outside it.
struct ColorConfig {
  double hue_min_deg = 10.0, hue_max_deg = 42.0;  ///< may wrap: 350 to 20
  double saturation_min = 0.6, value_min = 0.16;
  double hue_softness_deg = 6.0, softness = 0.12;
  bool white_balance = true;
  double min_gain = 0.75, max_gain = 1.33;

  template <class V>
  void Visit(V& v) {
    v("hue_min_deg", hue_min_deg, "0 red, 30 orange, 60 yellow; may be above hue_max_deg: wraps");
    v("hue_max_deg", hue_max_deg, "upper end of the hue; 0 to 360 is every hue");
    v("saturation_min", saturation_min, "0 grey to 1 pure");
    v("value_min", value_min, "brightest channel as a share of the light on the scene, 0 to 1");
    v("hue_softness_deg", hue_softness_deg, "width over which the score falls outside the range");
    v("softness", softness, "the same for saturation and value, 0 to 1");
    v("white_balance", white_balance, "undo the tint of the light, estimated on greyish pixels");
    v("min_gain", min_gain, "least gain of a channel");
    v("max_gain", max_gain, "greatest gain of a channel");
  }
  std::string Problem() const;
};

/// What the target's blob looks like in the image.
struct ShapeConfig {
  double aspect = 0.57, aspect_tolerance = 0.35;
  double fill = 0.93, fill_tolerance = 0.2;
  double inset = 0.0, outline_sigma = 0.0;
  double min_area_px = 20.0, min_score = 0.0;
  int max_candidates = 16;

  template <class V>
  void Visit(V& v) {
    v("aspect", aspect, "width over height of the whole blob");
    v("aspect_tolerance", aspect_tolerance, "one standard deviation of its logarithm");
    v("fill", fill, "share of its box that the blob fills");
    v("fill_tolerance", fill_tolerance, "one standard deviation");
    v("inset", inset, "the target lies so far inside the colour's outline, share of its width");
    v("outline_sigma", outline_sigma,
      "its sides depart so far from the model's, as a cone's from a cylinder's, in every frame "
      "alike: one standard deviation, share of its width");
    v("min_area_px", min_area_px, "smaller blobs are noise, px^2");
    v("min_score", min_score, "candidates below are not looked at, 0 to 1");
    v("max_candidates", max_candidates, "the best so many are looked at");
  }
  std::string Problem() const;
};

struct MarkerConfig {
  std::string dictionary = "DICT_4X4_50";
  int id = 0;
  double side = 0.2, depth = 0.15;
  double corner_sigma_px = 0.5;

  template <class V>
  void Visit(V& v) {
    v("dictionary", dictionary,
      "DICT_4X4_50, DICT_5X5_50, DICT_6X6_250, DICT_ARUCO_ORIGINAL, DICT_APRILTAG_16h5, "
      "DICT_APRILTAG_25h9 or DICT_APRILTAG_36h11");
    v("id", id, "the target's marker, one that the dictionary has; -1: any");
    v("side", side, "edge of the black square, m");
    v("depth", depth, "from the marker along the line of sight to the target's centre, m");
    v("corner_sigma_px", corner_sigma_px, "standard deviation of a corner");
  }
  std::string Problem() const;
};

struct NetworkConfig {
  std::string file;
  int input_width_px = 320, input_height_px = 320;
  int class_id = 0;
  double min_score = 0.5, overlap = 0.45, edge_sigma_px = 2.5;

  template <class V>
  void Visit(V& v) {
    v("file", file, "ONNX file; output rows: centre x, centre y, width, height (input px), scores");
    v("input_width_px", input_width_px, "the image is scaled to this");
    v("input_height_px", input_height_px, "the image is scaled to this");
    v("class_id", class_id, "which score is the target's");
    v("min_score", min_score, "boxes below are left out, 0 to 1");
    v("overlap", overlap, "boxes that overlap more than this are one, 0 to 1");
    v("edge_sigma_px", edge_sigma_px, "standard deviation of a box's edge");
  }
  std::string Problem() const;
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

/// Standard deviations of what is measured and limits of what is believed.
struct FitConfig {
  double edge_sigma_px = 0.5, edge_weight = 3.0;
  double lidar_sigma = 0.025, lidar_weight = 16.0;
  double prior_gate = 30.0, lidar_gate = 0.35;
  bool estimate_shape = false;
  double shape_sigma = 0.03;
  int max_iterations = 8;

  template <class V>
  void Visit(V& v) {
    v("edge_sigma_px", edge_sigma_px,
      "of one edge of the silhouette where the image is sharp; more where it is blurred");
    v("edge_weight", edge_weight, "independent samples that one edge counts for");
    v("lidar_sigma", lidar_sigma, "of one LiDAR point, m");
    v("lidar_weight", lidar_weight,
      "independent samples that one sweep's points count for at most");
    v("prior_gate", prior_gate, "greatest squared Mahalanobis distance from the prediction, 6 dof");
    v("lidar_gate", lidar_gate, "points further from the expected surface are something else, m");
    v("estimate_shape", estimate_shape, "estimate radius and height as well");
    v("shape_sigma", shape_sigma, "of the configured radius and height when estimated, m");
    v("max_iterations", max_iterations, "of the solver");
  }
  std::string Problem() const;
};

/// Constant velocity with white acceleration, and the honesty of what is published.
struct MotionConfig {
  double acceleration_density = 0.12, hidden_density = 0.5, vertical_density = 0.02;
  double initial_speed_sigma = 1.2, initial_vertical_speed_sigma = 0.1;
  double max_speed = 5.0, hidden_time = 3.0, ground_sigma = 0.15;
  double floor_sigma = 0.003, pose_sigma = 0.005, tilt_sigma_deg = 0.35, heading_sigma_deg = 0.12;

  template <class V>
  void Visit(V& v) {
    v("acceleration_density", acceleration_density, "of horizontal acceleration, m^2/s^3");
    v("hidden_density", hidden_density,
      "the same while it is not seen: a turn lasts, and adds up over seconds, m^2/s^3");
    v("vertical_density", vertical_density, "of vertical acceleration, m^2/s^3");
    v("initial_speed_sigma", initial_speed_sigma, "of a new target, horizontal, m/s");
    v("initial_vertical_speed_sigma", initial_vertical_speed_sigma, "of a new target, m/s");
    v("max_speed", max_speed, "a target found again lies where this speed reaches, m/s");
    v("hidden_time", hidden_time, "over which a target that is not seen may stop or turn, s");
    v("ground_sigma", ground_sigma, "how far the ground rises or falls meanwhile, m");
    v("floor_sigma", floor_sigma, "added to every axis of the covariance sent out, m");
    v("pose_sigma", pose_sigma, "least standard deviation of the drone's position, m");
    v("tilt_sigma_deg", tilt_sigma_deg, "least standard deviation of its roll and pitch");
    v("heading_sigma_deg", heading_sigma_deg, "least standard deviation of its heading");
  }
  std::string Problem() const;
};

/// When the target counts as found, hidden and lost.
struct StateConfig {
  double acquire_score = 0.35;
  int confirm_frames = 2;
  double hidden_after = 0.08, lost_after = 5.0, lost_sigma = 3.0;
  double sure_sigma = 0.6, standing_after = 3.0, standing_range = 10.0;
  double decoy_radius = 0.5, decoy_memory = 60.0;

  template <class V>
  void Visit(V& v) {
    v("acquire_score", acquire_score, "least score of a detection that starts a track, 0 to 1");
    v("confirm_frames", confirm_frames, "frames that must agree before a new target is believed");
    v("hidden_after", hidden_after, "unseen for longer: occluded, s");
    v("lost_after", lost_after, "unseen for longer: lost, s");
    v("lost_sigma", lost_sigma, "horizontal standard deviation above which the target is lost, m");
    v("sure_sigma", sure_sigma,
      "horizontal standard deviation of a hidden target above which what is found must drive, m");
    v("standing_after", standing_after,
      "what stands is taken for the target after so long, beyond 5 m later, s");
    v("standing_range", standing_range, "and only nearer than this, m");
    v("decoy_radius", decoy_radius,
      "what is seen nearer than this to a look-alike, a candidate, the target in view or where a "
      "hidden one is expected or stood, is taken for that, m");
    v("decoy_memory", decoy_memory, "a look-alike not seen again is remembered for so long, s");
  }
  std::string Problem() const;
};

struct PerceptionConfig {
  world::Rig rig;
  std::string target_shape = "cylinder";
  double target_radius = 0.15, target_height = 0.5;
  DetectorConfig detector;
  FitConfig fit;
  MotionConfig motion;
  StateConfig state;
  double max_extrapolation = 0.05, max_pose_age = 0.2, max_sweep_age = 0.3;

  template <class V>
  void Visit(V& v) {
    v("rig", rig, "calibration: where the sensors sit, the pinhole camera");
    v("target_shape", target_shape, "cylinder (upright), box (upright, its base square) or sphere");
    v("target_radius", target_radius, "of the target; half the width of a box, m");
    v("target_height", target_height, "of the target, m");
    v("detector", detector, "finds the target in the image");
    v("fit", fit, "places it in space");
    v("motion", motion, "how it may move, what is sent out");
    v("state", state, "found, hidden, lost");
    v("max_extrapolation", max_extrapolation,
      "the last pose is carried forward, or the first one kept back, this far; a frame beyond is "
      "not used, s");
    v("max_pose_age", max_pose_age,
      "only for what is said of a frame not used for its pose: with one this near 'the pose is too "
      "old', else 'no pose'; s");
    v("max_sweep_age", max_sweep_age, "older LiDAR points are not used, s");
  }
  std::string Problem() const;
};

}  // namespace chase::perception
