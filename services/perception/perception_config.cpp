#include "services/perception/perception_config.h"

namespace chase::perception {

namespace {

std::string RigProblem(world::Rig rig) {
  LimitCheck check;
  check.Limit("width_px", rig.width_px, 16, 16384);
  check.Limit("height_px", rig.height_px, 16, 16384);
  check.Limit("focal_px", rig.focal_px, 10, 20000);
  rig.Visit(check);
  return check.problem.empty() ? rig.LensProblem() : "rig." + check.problem;
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
