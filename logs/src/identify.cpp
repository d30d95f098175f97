#include "logs/src/identify.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "services/fcu/conversions.h"

namespace chase::logs {
namespace {

using config::Change;

constexpr char kBy[] = "by chase-log identify";

// Twice the uncertainty may cost control 0.03 m, a quarter of its tracking tube: by its
// position_gain of 6 1/s^2 that is an acceleration of 0.18 m/s^2.
constexpr double kDragEnough = 0.045;      // 1/s, at 2 m/s
constexpr double kScaleEnough = 0.01;      // of gravity
constexpr double kCurvatureEnough = 0.04;  // at a tilt of 35 degrees, 22 % beyond the hover
constexpr double kTimeEnough = 0.005;      // s: a setpoint's period
constexpr double kGainEnough = 0.5;        // 1/s: of a lag of 1/6.5 s by a period and more
constexpr double kShareEnough = 0.05;      // of a lag of 1/6.5 s by a period and more

struct Row {
  const char *name, *unit;
  Parameter parameter;
  double enough;        // uncertainty
  const char* excited;  // by what motion
};

/// Control takes one drag for all headings: it is as uncertain as along the worse.
Parameter LevelDrag(const Identification& i) {
  const Parameter &mean = i.drag_horizontal, &a = i.drag_forward, &b = i.drag_sideways;
  return {mean.value, std::max({mean.sigma, a.sigma, b.sigma}),
          std::max({mean.systematic, a.systematic, b.systematic})};
}

std::vector<Row> Rows(const Identification& i) {
  const char* const level = "level flight to and fro at 1 m/s and more, on two courses";
  const char* const climbs = "climbs and descents at 1 m/s";
  const char* const agile = "quick turns and changes of speed";
  return {{"drag, horizontal", "1/s", LevelDrag(i), kDragEnough, level},
          {"  forward", "1/s", i.drag_forward, kDragEnough, "level flight nose first"},
          {"  sideways", "1/s", i.drag_sideways, kDragEnough, "level flight sideways"},
          {"drag, vertical", "1/s", i.drag_vertical, kDragEnough, climbs},
          {"hover thrust", "m/s^2", i.hover_thrust, kScaleEnough * i.hover_thrust.value, climbs},
          {"thrust scale", "", i.thrust_scale, kScaleEnough, climbs},
          {"thrust curvature", "", i.thrust_curvature, kCurvatureEnough, climbs},
          {"thrust lag", "s", i.thrust_lag, kTimeEnough, climbs},
          {"attitude gain", "1/s", i.attitude_gain, kGainEnough, agile},
          {"rates followed", "", i.rate_share, kShareEnough, agile},
          {"rate lag", "s", i.rate_lag, kTimeEnough, agile},
          {"lead", "s", i.lead, kTimeEnough, agile}};
}

bool Shown(const Parameter& p, double enough) {
  return std::isfinite(p.value) && p.sigma <= enough;  // false for NaN
}

/// What flight would show it; time helps against what averages apart alone.
std::string Cure(const Row& row, double seconds) {
  const Parameter& p = row.parameter;
  std::string text =
      fmt::format(" not observable, +- {:.3g} is needed: {}", row.enough, row.excited);
  if (p.systematic >= row.enough)
    return text + fmt::format("; however long it is, +- {:.3g} is left", p.systematic);
  if (!std::isfinite(p.sigma)) return text;
  const double left = p.systematic * p.systematic;
  const double more = (p.sigma * p.sigma - left) / (row.enough * row.enough - left);
  return text + fmt::format(", {:.1f} times as strong or for {:.0f} s", std::sqrt(more),
                            std::ceil(seconds * more));
}

std::string Line(const Row& row, double seconds) {
  const Parameter& p = row.parameter;
  std::string text = fmt::format("{:<18} {:>20} {:<6}", row.name, "-", row.unit);
  if (std::isfinite(p.sigma))
    text = fmt::format("{:<18} {:>8.4f} +- {:<8.4f} {:<6}", row.name, p.value, p.sigma, row.unit);
  if (!Shown(p, row.enough)) text += Cure(row, seconds);
  return text.substr(0, text.find_last_not_of(' ') + 1) + "\n";
}

std::string PlusMinus(const Parameter& p) { return fmt::format("+- {:.2g}", p.sigma); }

// Within what control takes: a drag may come out somewhat below nothing.
double Rounded(double value, double low, double high) {
  return std::round(std::clamp(value, low, high) * 1e4) / 1e4;
}

}  // namespace

std::string Format(const Identification& i) {
  std::string text = fmt::format(
      "{:.1f} s of flight; speed forward {:.2f}, sideways {:.2f}, vertical {:.2f} m/s rms\n",
      i.seconds, i.speeds.x(), i.speeds.y(), i.speeds.z());
  for (const Row& row : Rows(i)) text += Line(row, i.seconds);
  if (Shown(i.thrust_scale, kScaleEnough))
    text +=
        fmt::format("chase-fcu: h (1 + motor_curve (h - 1)), h its hover_thrust, times {:.3f}\n",
                    1.0 / i.thrust_scale.value);
  return text;
}

std::vector<Change> SetInControl(const Identification& i, bool keeps,
                                 control::ControlConfig* config) {
  const Parameter horizontal = LevelDrag(i);
  const bool level = Shown(horizontal, kDragEnough);
  const bool vertical = Shown(i.drag_vertical, kDragEnough);
  std::vector<Change> changes;
  if (keeps ? level || vertical : level && vertical) {
    if (level) config->drag.head<2>().setConstant(Rounded(horizontal.value, 0.0, 5.0));
    if (vertical) config->drag.z() = Rounded(i.drag_vertical.value, 0.01, 5.0);
    changes.push_back(
        {"drag", fmt::format("[{}, {}, {}]", config->drag.x(), config->drag.y(), config->drag.z()),
         fmt::format("{}: 1/s, x and y {}, z {}; along B, taken for W", kBy,
                     level ? PlusMinus(horizontal) : "as before",
                     vertical ? PlusMinus(i.drag_vertical) : "as before")});
  }
  if (Shown(i.lead, kTimeEnough)) {
    config->lead = Rounded(i.lead.value, 0.0, 0.3);
    changes.push_back({"lead", fmt::format("{}", config->lead),
                       fmt::format("{}: s, {}", kBy, PlusMinus(i.lead))});
  }
  return changes;
}

std::vector<Change> SetInPlanning(const Identification& i, planning::PlanningConfig* config) {
  const Parameter horizontal = LevelDrag(i);
  if (!Shown(horizontal, kDragEnough)) return {};
  config->planner.drag = Rounded(horizontal.value, 0.0, 5.0);
  return {{"planner.drag", fmt::format("{}", config->planner.drag),
           fmt::format("{}: 1/s, {}", kBy, PlusMinus(horizontal))}};
}

// With f(u) = c u^2 + (1 - c) u (fcu::ThrustShare): at the hover h f(h) gives gravity, and
// u f'(u) / f(u) = 1 + c u / (1 - c + c u) is the relative change of thrust per relative change of
// command. The vehicle's share adds its own curvature to 1; the new h and c give both.
std::vector<Change> SetInFcu(const Identification& i, fcu::FcuConfig* config) {
  if (!Shown(i.thrust_scale, kScaleEnough)) return {};
  const double c = config->motor_curve;
  const double h = fcu::ThrustShare(i.hover_thrust.value, config->hover_thrust, c);
  config->hover_thrust = Rounded(h, 0.0, 1.0);
  std::vector<Change> changes = {
      {"hover_thrust", fmt::format("{}", config->hover_thrust),
       fmt::format("{}: {}", kBy, PlusMinus({h, h * i.thrust_scale.sigma}))}};
  if (!Shown(i.thrust_curvature, kCurvatureEnough)) return changes;
  const double slope = 1.0 + c * h / (1.0 - c + c * h);
  const double beyond = (1.0 + i.thrust_curvature.value) * slope - 1.0;
  config->motor_curve = beyond > 0.0 ? Rounded(beyond / (h + beyond * (1.0 - h)), 0.0, 1.0) : 0.0;
  changes.push_back(
      {"motor_curve", fmt::format("{}", config->motor_curve), fmt::format("{}", kBy)});
  return changes;
}

std::string ControlFile(const Identification& i, const std::string& origin,
                        const std::string& present) {
  control::ControlConfig config;
  if (!present.empty()) config::Load(present, &config);
  const auto changes = SetInControl(i, !present.empty(), &config);
  if (changes.empty()) return "";
  std::string text =
      fmt::format("# From {}, {:.1f} s of flight; standard uncertainties.\n", origin, i.seconds);
  for (const Change& c : changes) text += fmt::format("{}: {}  # {}\n", c.key, c.value, c.comment);
  config::LoadText(text, origin, &config);  // as control will read it
  return text;
}

}  // namespace chase::logs
