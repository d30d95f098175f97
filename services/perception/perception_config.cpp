#include "services/perception/perception_config.h"

#include <cmath>
#include <sstream>

namespace chase::perception {

namespace {

/// Collects the first complaint: field, value, limit.
class Check {
 public:
  Check& In(const char* field, double value, double low, double high) {
    if (problem_.empty() && !(value >= low && value <= high)) {
      std::ostringstream out;
      out << field << " is " << value << ", must be " << low << " to " << high;
      problem_ = out.str();
    }
    return *this;
  }
  Check& Finite(const std::string& field, double value) {
    return That(std::isfinite(value),
                field + " is " + std::to_string(value) + ", must be a finite number");
  }
  Check& Finite(const std::string& field, const Eigen::Vector3d& value) {
    for (int i = 0; i < 3; ++i) Finite(field + "[" + std::to_string(i) + "]", value[i]);
    return *this;
  }
  Check& That(bool holds, const std::string& what) {
    if (problem_.empty() && !holds) problem_ = what;
    return *this;
  }
  std::string Result() const { return problem_; }

 private:
  std::string problem_;
};

}  // namespace

std::string ColorConfig::Problem() const {
  return Check()
      .In("hue_min_deg", hue_min_deg, 0, 360)
      .In("hue_max_deg", hue_max_deg, 0, 360)
      .In("saturation_min", saturation_min, 0, 1)
      .In("value_min", value_min, 0, 1)
      .In("hue_softness_deg", hue_softness_deg, 0.1, 90)
      .In("softness", softness, 1e-3, 1)
      .In("min_gain", min_gain, 0.2, 1)
      .In("max_gain", max_gain, 1, 5)
      .Result();
}

std::string ShapeConfig::Problem() const {
  return Check()
      .In("aspect", aspect, 0.05, 20)
      .In("aspect_tolerance", aspect_tolerance, 0.01, 10)
      .In("fill", fill, 0.05, 1)
      .In("fill_tolerance", fill_tolerance, 0.01, 10)
      .In("inset", inset, 0, 0.4)
      .In("outline_sigma", outline_sigma, 0, 0.5)
      .In("min_area_px", min_area_px, 4, 1e6)
      .In("min_score", min_score, 0, 1)
      .In("max_candidates", max_candidates, 1, 100)
      .Result();
}

std::string MarkerConfig::Problem() const {
  return Check()
      .In("id", id, -1, 10000)
      .In("side", side, 0.01, 5)
      .In("depth", depth, -1, 5)
      .In("corner_sigma_px", corner_sigma_px, 0.01, 20)
      .Result();
}

std::string NetworkConfig::Problem() const {
  return Check()
      .In("input_width_px", input_width_px, 8, 4096)
      .In("input_height_px", input_height_px, 8, 4096)
      .In("class_id", class_id, 0, 10000)
      .In("min_score", min_score, 0, 1)
      .In("overlap", overlap, 0, 1)
      .In("edge_sigma_px", edge_sigma_px, 0.1, 50)
      .Result();
}

std::string DetectorConfig::Problem() const {
  return Check()
      .That(kind == "color" || kind == "marker" || kind == "network",
            "kind is '" + kind + "', must be color, marker or network")
      .That(kind != "network" || !network.file.empty(),
            "network.file is empty, kind network needs an ONNX file")
      .Result();
}

std::string FitConfig::Problem() const {
  return Check()
      .In("edge_sigma_px", edge_sigma_px, 0.05, 20)
      .In("edge_weight", edge_weight, 0.1, 100)
      .In("lidar_sigma", lidar_sigma, 1e-3, 1)
      .In("lidar_weight", lidar_weight, 1, 1000)
      .In("prior_gate", prior_gate, 6, 1000)
      .In("lidar_gate", lidar_gate, 0.02, 5)
      .In("shape_sigma", shape_sigma, 1e-4, 1)
      .In("max_iterations", max_iterations, 1, 100)
      .Result();
}

std::string MotionConfig::Problem() const {
  return Check()
      .In("acceleration_density", acceleration_density, 1e-4, 100)
      .In("hidden_density", hidden_density, 1e-4, 100)
      .In("vertical_density", vertical_density, 1e-5, 100)
      .In("initial_speed_sigma", initial_speed_sigma, 0.01, 20)
      .In("initial_vertical_speed_sigma", initial_vertical_speed_sigma, 0.01, 20)
      .In("max_speed", max_speed, 0.1, 50)
      .In("hidden_time", hidden_time, 0.1, 100)
      .In("ground_sigma", ground_sigma, 0.01, 100)
      .In("floor_sigma", floor_sigma, 1e-4, 1)
      .In("pose_sigma", pose_sigma, 0, 1)
      .In("tilt_sigma_deg", tilt_sigma_deg, 0, 20)
      .In("heading_sigma_deg", heading_sigma_deg, 0, 20)
      .Result();
}

std::string StateConfig::Problem() const {
  return Check()
      .In("acquire_score", acquire_score, 0, 1)
      .In("confirm_frames", confirm_frames, 1, 100)
      .In("hidden_after", hidden_after, 0.01, 5)
      .In("lost_after", lost_after, hidden_after, 60)
      .In("lost_sigma", lost_sigma, 0.1, 20)
      .In("sure_sigma", sure_sigma, 0.01, 20)
      .In("standing_after", standing_after, 0, 60)
      .In("standing_range", standing_range, 0, 100)
      .In("decoy_radius", decoy_radius, 0.05, 10)
      .In("decoy_memory", decoy_memory, 0, 1e6)
      .Result();
}

std::string PerceptionConfig::Problem() const {
  return Check()
      .That(target_shape == "cylinder" || target_shape == "box" || target_shape == "sphere",
            "target_shape is '" + target_shape + "', must be cylinder, box or sphere")
      .In("target_radius", target_radius, 0.01, 5)
      .In("target_height", target_height, 0.02, 10)
      .In("max_extrapolation", max_extrapolation, 0, 0.5)
      .In("max_pose_age", max_pose_age, max_extrapolation, 2)
      .In("max_sweep_age", max_sweep_age, 0.1, 2)
      .In("rig.width_px", rig.width_px, 16, 16384)
      .In("rig.height_px", rig.height_px, 16, 16384)
      .In("rig.focal_px", rig.focal_px, 10, 20000)
      .That(rig.LensProblem().empty(), rig.LensProblem())
      .Finite("rig.center_u_px", rig.center_u_px)
      .Finite("rig.center_v_px", rig.center_v_px)
      .Finite("rig.camera_pitch_deg", rig.camera_pitch_deg)
      .Finite("rig.camera_position", rig.camera_position)
      .Finite("rig.lidar_position", rig.lidar_position)
      .Finite("rig.lidar_rpy_deg", rig.lidar_rpy_deg)
      .Result();
}

}  // namespace chase::perception
