#include "common/world/scenario.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <sstream>
#include <stdexcept>

#include "common/config/config.h"
#include "common/world/commands.h"

namespace chase::world {
namespace {

std::string Number(double value) { return config::detail::FormatNumber(value); }

/// "field is value; it must be limit", or empty when `ok`.
std::string Check(bool ok, const std::string& field, const std::string& value,
                  const std::string& limit) {
  return ok ? "" : field + " is " + value + "; it must be " + limit;
}
std::string Positive(const std::string& field, double value) {
  return Check(value > 0.0 && std::isfinite(value), field, Number(value), "above 0");
}
std::string NotNegative(const std::string& field, double value) {
  return Check(value >= 0.0 && std::isfinite(value), field, Number(value), "0 or more");
}

std::string First(std::initializer_list<std::string> problems) {
  for (const auto& problem : problems)
    if (!problem.empty()) return problem;
  return "";
}

template <class Spec>
std::string FirstOf(const std::string& name, const std::vector<Spec>& specs) {
  for (std::size_t i = 0; i < specs.size(); ++i) {
    const std::string problem = specs[i].Problem();
    if (!problem.empty()) return name + "[" + std::to_string(i) + "]: " + problem;
  }
  return "";
}

template <class Spec>
std::string Within(const std::string& name, const Spec& spec) {
  const std::string problem = spec.Problem();
  return problem.empty() ? "" : name + ": " + problem;
}

bool Grows(const std::vector<double>& times) {
  const auto falls = [](double a, double b) { return !(b > a); };
  return std::adjacent_find(times.begin(), times.end(), falls) == times.end();
}

std::string Folder(const std::string& file) {
  const auto slash = file.rfind('/');
  return slash == std::string::npos ? "" : file.substr(0, slash + 1);
}

}  // namespace

std::string WallSpec::Problem() const {
  return First({Check((to - from).norm() > 0.0, "to", "equal to from", "another point"),
                Positive("height", height), Positive("thickness", thickness)});
}
std::string BoxSpec::Problem() const { return Positive("size", size.minCoeff()); }
std::string CylinderSpec::Problem() const {
  return First({Positive("radius", radius), Positive("height", height)});
}
std::string EllipsoidSpec::Problem() const { return Positive("radii", radii.minCoeff()); }
std::string TreeSpec::Problem() const {
  return First({Positive("trunk_radius", trunk_radius), Positive("height", height),
                NotNegative("crown_radius", crown_radius),
                Check(crown_base < height, "crown_base", Number(crown_base), "below height")});
}
std::string ForestSpec::Problem() const {
  if (count == 0) return "";
  return First(
      {Check(count > 0 && count <= 20000, "count", std::to_string(count), "0 to 20000"),
       Check((max - min).minCoeff() > 0.0, "max", Number((max - min).minCoeff()) + " beyond min",
             "greater than min in x and y"),
       NotNegative("gap", gap), Positive("trunk_radius_min", trunk_radius_min),
       Check(trunk_radius_max >= trunk_radius_min, "trunk_radius_max", Number(trunk_radius_max),
             "at least trunk_radius_min"),
       NotNegative("path_clearance", path_clearance)});
}
std::string GroundSpec::Problem() const {
  return First({Check(slope.norm() <= 1.0, "slope", Number(slope.norm()), "1 at most (45 degrees)"),
                NotNegative("roughness", roughness), Positive("wavelength", wavelength)});
}
std::string MoverSpec::Problem() const {
  return First({Check(shape == "box" || shape == "cylinder" || shape == "ellipsoid", "shape",
                      "'" + shape + "'", "box, cylinder or ellipsoid"),
                Positive("size", size.minCoeff()),
                Check(!waypoints.empty(), "waypoints", "empty", "one point or more"),
                Check(times.empty() || times.size() == waypoints.size(), "times",
                      std::to_string(times.size()) + " numbers", "one for each waypoint, or none"),
                Check(Grows(times), "times", "out of order", "later from waypoint to waypoint"),
                Check(times.empty() || !loop, "loop", "true", "false beside times"),
                NotNegative("speed", speed)});
}
std::string StopSpec::Problem() const {
  return First({Check(waypoint >= 0, "waypoint", std::to_string(waypoint), "0 or more"),
                NotNegative("duration", duration)});
}
std::string TargetSpec::Problem() const {
  const int last = static_cast<int>(waypoints.size()) - 1;
  const bool on_path = std::all_of(stops.begin(), stops.end(),
                                   [&](const StopSpec& stop) { return stop.waypoint <= last; });
  return First(
      {Check(shape == "cylinder" || shape == "box" || shape == "sphere", "shape", "'" + shape + "'",
             "cylinder, box or sphere"),
       Check(shape != "sphere" || std::abs(height - 2.0 * radius) < 1e-9, "height", Number(height),
             "twice the radius of a sphere, " + Number(2.0 * radius)),
       FirstOf("stops", stops),
       Check(on_path, "stops", "at a waypoint beyond the last", std::to_string(last) + " at most"),
       NotNegative("lateral_acceleration", lateral_acceleration), Positive("radius", radius),
       Positive("height", height),
       Check(color.minCoeff() >= 0.0 && color.maxCoeff() <= 1.0, "color", "outside 0 to 1",
             "within 0 to 1"),
       NotNegative("carrier_size", carrier_size.minCoeff()), Positive("speed", speed),
       Positive("acceleration", acceleration), NotNegative("corner_radius", corner_radius)});
}
std::string ChaserSpec::Problem() const {
  return First({Positive("takeoff_height", takeoff_height),
                Positive("desired_distance", desired_distance), Positive("radius", radius)});
}
std::string SensorsSpec::Problem() const {
  return Check(mode == "raw" || mode == "truth", "mode", "'" + mode + "'", "raw or truth");
}
std::string WindSpec::Problem() const {
  return First({NotNegative("gust", gust), Positive("gust_time", gust_time)});
}

std::string WorldSpec::Problem() const {
  return First({Within("ground", ground), FirstOf("walls", walls), FirstOf("boxes", boxes),
                FirstOf("cylinders", cylinders), FirstOf("ellipsoids", ellipsoids),
                FirstOf("trees", trees), Within("forest", forest)});
}

std::string CommandSpec::Problem() const {
  std::string all;
  for (const char* one : kCommandNames) all += (all.empty() ? "" : ", ") + std::string(one);
  if (!CommandNamed(command)) return Check(false, "command", "'" + command + "'", "one of " + all);
  const size_t places = CommandNamed(command) == kSelectCommand ? 2 : 0;
  return Check(at_px.size() == places, "at_px", std::to_string(at_px.size()) + " numbers",
               places > 0 ? "[column, row] of select" : "left out but of select");
}

std::string ServiceOverride::Problem() const {
  static const std::vector<std::string> known = {"lidar",      "camera",     "odometry", "mapping",
                                                 "perception", "prediction", "planning", "control",
                                                 "mission",    "simulator"};
  std::string all;
  for (const auto& one : known) all += (all.empty() ? "" : ", ") + one;
  return Check(std::find(known.begin(), known.end(), name) != known.end(), "name", "'" + name + "'",
               "one of " + all);
}

namespace {

/// A second entry for a service would never be looked at.
std::string NamedTwice(const std::vector<ServiceOverride>& services) {
  for (std::size_t i = 1; i < services.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (services[i].name == services[k].name)
        return "services[" + std::to_string(i) + "].name is '" + services[i].name +
               "' a second time; put all of its config into one entry";
  return "";
}

/// A fault before power-on or after the end.
std::string NeverStrikes(const Scenario& s) {
  for (std::size_t i = 0; i < s.faults.size(); ++i) {
    const double at = s.faults[i].at;
    const bool flown = at == FaultSpec::kDrawn || (at >= -s.settle_s && at < s.duration_s);
    const std::string problem =
        Check(flown, "at", Number(at),
              "from -settle_s, " + Number(-s.settle_s) + ", to below duration_s, " +
                  Number(s.duration_s) + ", or left out to be drawn from the seed");
    if (!problem.empty()) return "faults[" + std::to_string(i) + "]: " + problem;
  }
  return "";
}

/// A command that never comes, or one that comes before the one above it.
std::string OutOfTime(const Scenario& s) {
  double before = -s.settle_s;
  for (std::size_t i = 0; i < s.commands.size(); ++i) {
    const double at = s.commands[i].at_s;
    const std::string problem =
        Check(at >= before && at < s.duration_s, "at_s", Number(at),
              "from " + Number(before) + " to below duration_s, " + Number(s.duration_s));
    if (!problem.empty()) return "commands[" + std::to_string(i) + "]: " + problem;
    before = at;
  }
  return "";
}

}  // namespace

std::string Scenario::Problem() const {
  const bool has_path = target.waypoints.size() >= 2 || !target.path_file.empty();
  return First(
      {Check(!name.empty(), "name", "missing", "given"), Positive("duration_s", duration_s),
       NotNegative("settle_s", settle_s),
       Check(has_path, "target.waypoints", std::to_string(target.waypoints.size()) + " points",
             "2 or more, or target.path_file be given"),
       Within("world", world), FirstOf("movers", movers), Within("target", target),
       Within("chaser", chaser), Within("sensors", sensors), Within("wind", wind),
       FirstOf("faults", faults), NeverStrikes(*this), FirstOf("commands", commands),
       OutOfTime(*this), FirstOf("services", services), NamedTwice(services)});
}

Scenario ParseScenario(const std::string& yaml, const std::string& origin) {
  Scenario scenario;
  config::LoadText(yaml, origin, &scenario);
  std::string& path = scenario.target.path_file;
  if (!path.empty() && path.front() != '/') path = Folder(origin) + path;
  return scenario;
}

Scenario LoadScenario(const std::string& file) {
  std::ifstream in(file);
  std::ostringstream text;
  if (!in || !(text << in.rdbuf()))
    throw std::runtime_error(file + ": scenario cannot be read; check the path and its rights");
  return ParseScenario(text.str(), file);
}

std::string ServiceConfig(const Scenario& scenario, const std::string& service) {
  for (const auto& entry : scenario.services)
    if (entry.name == service) return entry.config;
  return "";
}

}  // namespace chase::world
