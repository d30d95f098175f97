#include "test/compare/figure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>

#include "logs/src/gnuplot.h"

namespace chase::compare {
namespace {

using Json = nlohmann::ordered_json;
using logs::GnuplotString;

/// Remembers the order of first appearance.
void AddOnce(const std::string& name, std::vector<std::string>* names) {
  if (std::find(names->begin(), names->end(), name) == names->end()) names->push_back(name);
}

double Number(const Json& m, const char* key) { return m[key].get<double>(); }

std::string Block(const std::string& name, const std::string& rows) {
  return "$" + name + " << EOD\n" + rows + "EOD\n";
}

std::string Begin(const std::string& file, int width, int height) {
  return fmt::format(
      "set terminal pngcairo size {},{} font 'DejaVu Sans,11'\nset output {}\n"
      "set grid lc rgb '#e3e6ea' lt 1\nset border lc rgb '#60656d'\n",
      width, height, GnuplotString(file));
}

double WidthOf(const std::string& planner) { return planner == "chase" ? 3.2 : 1.7; }

/// Rows "scenario index, value per panel" of one planner.
std::string PanelRows(const Flights& flights, const std::string& planner,
                      const std::vector<std::string>& scenarios) {
  std::string rows;
  for (const Json& f : flights) {
    if (PlannerOf(f) != planner) continue;
    const Json& m = f["metrics"];
    const auto at = std::find(scenarios.begin(), scenarios.end(), m["scenario"]);
    rows += std::to_string(at - scenarios.begin());
    for (const Panel& p : Panels()) rows += fmt::format(" {:.6g}", p.value(m));
    rows += "\n";
  }
  return rows;
}

/// Around 1 and all values, so that a straight line at 1 has a range, too.
std::string RatioRange(const Flights& flights, const Panel& panel) {
  double low = 0.99, high = 1.0;
  for (const Json& f : flights) {
    low = std::min(low, panel.value(f["metrics"]));
    high = std::max(high, panel.value(f["metrics"]));
  }
  const double rim = 0.06 * (high - low);
  return fmt::format("set yrange [{}:{}]\n", low - rim, high + rim);
}

/// Gnuplot's own, which is whole decades; the one around the values where they are all the same.
std::string LogarithmicRange(const Flights& flights, const Panel& panel) {
  double low = HUGE_VAL, high = 0.0;
  for (const Json& f : flights)
    if (const double value = panel.value(f["metrics"]); value > 0.0)
      low = std::min(low, value), high = std::max(high, value);
  if (high > 1.01 * low) return "set yrange [*:*]\n";
  const double decade = high > 0.0 ? std::floor(std::log10(low)) : 0.0;
  return fmt::format("set yrange [1e{:.0f}:1e{:.0f}]\n", decade, decade + 1.0);
}

std::string ScenarioTics(const std::vector<std::string>& scenarios) {
  std::string tics = "set xtics (";
  const size_t every = scenarios.size() / 30 + 1;
  for (size_t i = 0; i < scenarios.size(); i += every)
    tics += fmt::format("{}{} {}", i ? ", " : "", GnuplotString(scenarios[i]), i);
  return tics + ") noenhanced\n";
}

std::string CircleRows(const Json& flight, double growth) {
  std::string rows;
  for (const auto& o : flight["obstacles"])
    rows += fmt::format("{} {} {}\n", o[0].get<double>(), o[1].get<double>(),
                        o[2].get<double>() + growth);
  return rows;
}

std::string TrackRows(const Json& flight, size_t column) {
  std::string rows;
  for (const auto& s : flight["track"])
    rows += fmt::format("{} {}\n", s[column].get<double>(), s[column + 1].get<double>());
  return rows;
}

/// Ratio of height to width of what the target and the planners cover, and its ranges.
std::string Ranges(const std::vector<const Json*>& flights, double* ratio) {
  constexpr double kRim = 1.5;  // m
  double low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL};
  for (const Json* f : flights)
    for (const auto& s : (*f)["track"])
      for (size_t column : {size_t{1}, size_t{4}})
        for (size_t axis = 0; axis < 2; ++axis) {
          low[axis] = std::min(low[axis], s[column + axis].get<double>() - kRim);
          high[axis] = std::max(high[axis], s[column + axis].get<double>() + kRim);
        }
  *ratio = (high[1] - low[1]) / (high[0] - low[0]);
  return fmt::format("set xrange [{}:{}]\nset yrange [{}:{}]\n", low[0], high[0], low[1], high[1]);
}

}  // namespace

const std::vector<Panel>& Panels() {
  static const std::vector<Panel> panels = {
      {"safe ratio", [](const Json& m) { return Number(m, "safe_ratio"); }, false},
      {"visible ratio", [](const Json& m) { return Number(m, "visible_ratio"); }, false},
      {"distance ratio", [](const Json& m) { return Number(m, "distance_ratio"); }, false},
      {"acceleration cost [m^2/s^4]", [](const Json& m) { return Number(m, "acceleration_cost"); },
       true},
      {"time to plan, mean [ms]", [](const Json& m) { return m["plan_ms"]["mean"].get<double>(); },
       true}};
  return panels;
}

std::vector<std::string> ScenariosOf(const Flights& flights) {
  std::vector<std::string> names;
  for (const Json& f : flights) AddOnce(f["metrics"]["scenario"], &names);
  return names;
}

std::vector<std::string> PlannersOf(const Flights& flights) {
  std::vector<std::string> names;
  for (const Json& f : flights) AddOnce(PlannerOf(f), &names);
  return names;
}

std::string PlannerOf(const Json& flight) {
  const Json& m = flight["metrics"];
  std::string name = m["planner"];
  if (m.contains("parameter_set")) name += fmt::format(":{}", m["parameter_set"].get<int>());
  return name;
}

std::string ColorOf(const std::string& planner, size_t index) {
  static const std::map<std::string, std::string> kOwn = {{"chase", "#1f5fa8"},
                                                          {"hierarchical", "#2e9e5b"},
                                                          {"naegeli_style", "#e8710a"},
                                                          {"penin_style", "#9c27b0"},
                                                          {"reference", "#8a8f98"}};
  static const std::vector<std::string> kOthers = {"#c62828", "#00897b", "#6d4c41", "#c0a000",
                                                   "#3949ab", "#d81b60", "#558b2f"};
  const auto own = kOwn.find(planner);
  return own != kOwn.end() ? own->second : kOthers[index % kOthers.size()];
}

void DrawPanels(const Flights& flights, const std::string& file) {
  const auto scenarios = ScenariosOf(flights), planners = PlannersOf(flights);
  logs::DrawPng(file, [&](const std::string& temporary) {
    std::string s = Begin(temporary, 1100, 1500);
    for (size_t k = 0; k < planners.size(); ++k)
      s += Block("p" + std::to_string(k), PanelRows(flights, planners[k], scenarios));
    s += "set multiplot layout 5,1 margins 0.08,0.985,0.035,0.945 spacing 0,0.042\n" +
         ScenarioTics(scenarios) +
         fmt::format("set xrange [-0.4:{}]\n", static_cast<double>(scenarios.size()) - 0.6);
    for (size_t panel = 0; panel < Panels().size(); ++panel) {
      const Panel& p = Panels()[panel];
      s += "set title " + GnuplotString(p.title) + " offset 0,-0.6\n";
      s += p.logarithmic ? "set logscale y\n" + LogarithmicRange(flights, p)
                         : "unset logscale y\n" + RatioRange(flights, p);
      s += panel == 0 ? "set key noenhanced at screen 0.5,0.985 center horizontal samplen 2.5\n"
                      : "unset key\n";
      s += "plot ";
      for (size_t k = 0; k < planners.size(); ++k)
        s +=
            fmt::format("{}$p{} using 1:{} with linespoints pt 7 ps 0.9 lw {} lc rgb '{}' title {}",
                        k ? ", " : "", k, panel + 2, WidthOf(planners[k]), ColorOf(planners[k], k),
                        GnuplotString(planners[k]));
      s += "\n";
    }
    return s + "unset multiplot\n";
  });
}

void DrawTopView(const Flights& flights, const std::string& scenario, const std::string& file) {
  std::vector<const Json*> flown;
  for (const Json& f : flights)
    if (f["metrics"]["scenario"] == scenario) flown.push_back(&f);
  if (flown.empty()) return;
  logs::DrawPng(file, [&](const std::string& temporary) {
    constexpr int kWidth = 1200, kFrame = 120;  // px; title, key and tics
    double ratio = 1.0;
    const std::string ranges = Ranges(flown, &ratio);
    const int height = kFrame + std::clamp(static_cast<int>(ratio * kWidth), 350, 1400);
    std::string s = Begin(temporary, kWidth, height) + ranges;
    s += "set title " + GnuplotString(scenario + ": paths seen from above") + " noenhanced\n";
    s += "set size ratio -1\nset xlabel 'x [m]'\nset ylabel 'y [m]'\n"
         "set key noenhanced tmargin center horizontal samplen 2.5\nset style fill solid 1 "
         "noborder\n";
    const double growth = (*flown[0]).value("drone_radius", 0.3);
    s += Block("bare", CircleRows(*flown[0], 0.0)) + Block("grown", CircleRows(*flown[0], growth)) +
         Block("target", TrackRows(*flown[0], 4));
    for (size_t k = 0; k < flown.size(); ++k)
      s += Block("p" + std::to_string(k), TrackRows(*flown[k], 1));
    s += "plot $grown with circles fc rgb '#e4e6ea' title 'grown by the drone''s radius', "
         "$bare with circles fc rgb '#a9afb9' title 'obstacles'";
    for (size_t k = flown.size(); k-- > 0;) {  // chase, the first, on top
      const std::string planner = PlannerOf(*flown[k]);
      s += fmt::format(", $p{} with lines lw {} lc rgb '{}' title {}", k, WidthOf(planner),
                       ColorOf(planner, k), GnuplotString(planner));
    }
    return s + ", $target with lines lw 2.2 dt 2 lc rgb '#202020' title 'target'\n";
  });
}

}  // namespace chase::compare
