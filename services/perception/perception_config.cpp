#include "services/perception/perception_config.h"

#include <cmath>

namespace chase::perception {

namespace {

std::string RigProblem(const world::Rig& rig) {
  LimitCheck check;
  check.Limit("rig.width_px", rig.width_px, 16, 16384);
  check.Limit("rig.height_px", rig.height_px, 16, 16384);
  check.Limit("rig.focal_px", rig.focal_px, 10, 20000);
  if (check.problem.empty()) check.problem = rig.LensProblem();
  const auto finite = [&](const std::string& field, double value) {
    if (check.problem.empty() && !std::isfinite(value))
      check.problem = field + " is " + std::to_string(value) + ", must be a finite number";
  };
  finite("rig.center_u_px", rig.center_u_px);
  finite("rig.center_v_px", rig.center_v_px);
  finite("rig.camera_pitch_deg", rig.camera_pitch_deg);
  for (int i = 0; i < 3; ++i) {
    const std::string at = "[" + std::to_string(i) + "]";
    finite("rig.camera_position" + at, rig.camera_position[i]);
    finite("rig.lidar_position" + at, rig.lidar_position[i]);
    finite("rig.lidar_rpy_deg" + at, rig.lidar_rpy_deg[i]);
  }
  return check.problem;
}

}  // namespace

std::string DetectorConfig::Problem() const {
  if (kind != "color" && kind != "marker" && kind != "network")
    return "kind is '" + kind + "', must be color, marker or network";
  if (kind == "network" && network.file.empty())
    return "network.file is empty, kind network needs an ONNX file";
  return "";
}

std::string PerceptionConfig::Problem() const {
  if (target_shape != "cylinder" && target_shape != "box" && target_shape != "sphere")
    return "target_shape is '" + target_shape + "', must be cylinder, box or sphere";
  const std::string problem = Limits::Problem();
  return problem.empty() ? RigProblem(rig) : problem;
}

}  // namespace chase::perception
