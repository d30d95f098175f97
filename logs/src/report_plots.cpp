#include "logs/src/report_plots.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>

#include "logs/src/gnuplot.h"

namespace chase::logs {
namespace {

constexpr const char* kChaser = "#1f5fa8";
constexpr const char* kTarget = "#e8710a";
constexpr const char* kGrey = "#8a8f98";
constexpr int kColors[] = {0x1f5fa8, 0xe8710a, 0x1d7f4b, 0xb455c9, 0x8a8f98, 0xd9a33a, 0x111111};

/// The color of the i-th of several, as gnuplot takes it in commands and data.
int Rgb(size_t i) { return kColors[i % std::size(kColors)]; }

/// A gnuplot script with its data inside.
class Script {
 public:
  void Line(const std::string& line) { text_ += line + "\n"; }

  /// A data block $name; blank lines between outlines break the pen.
  void Block(const std::string& name, const std::vector<Outline>& outlines, bool closed) {
    text_ += "$" + name + " << EOD\n";
    for (const Outline& o : outlines) {
      for (const auto& p : o) Row(p.x(), p.y());
      if (closed && !o.empty()) Row(o.front().x(), o.front().y());
      text_ += "\n";
    }
    text_ += "EOD\n";
  }
  void Block(const std::string& name, const ReportData::Series& s) {
    text_ += "$" + name + " << EOD\n";
    for (size_t i = 0; i < s.t.size(); ++i) Row(s.t[i], s.value[i]);
    text_ += "EOD\n";
  }
  /// A break parts the pen as well.
  void Row(double a, double b) {
    if (!std::isfinite(a) || !std::isfinite(b)) return Line("");
    fmt::format_to(std::back_inserter(text_), "{:.5g} {:.5g}\n", a, b);
  }

  const std::string& text() const { return text_; }

 private:
  std::string text_;
};

std::string Quoted(const std::string& text) { return GnuplotString(text); }

void Begin(Script* s, const std::string& file, const std::string& title, int width, int height) {
  s->Line(fmt::format("set terminal pngcairo size {},{} font 'DejaVu Sans,11'", width, height));
  s->Line("set output " + Quoted(file));
  s->Line("set title " + Quoted(title) + " noenhanced");
  s->Line("set grid lc rgb '#e3e6ea' lt 1");
  s->Line("set border lc rgb '#60656d'");
  s->Line("set key noenhanced tmargin center horizontal samplen 2.5");
  s->Line("set style fill solid 0.85");
}

template <class Draw>
void Picture(const std::string& folder, const std::string& name, Draw draw) {
  DrawPng((std::filesystem::path(folder) / name).string(), [&](const std::string& temporary) {
    Script script;
    draw(&script, temporary);
    return script.text();
  });
}

std::string TimeWords(const ReportData& d) { return d.truth ? "mission time [s]" : "time [s]"; }

const std::vector<Outline>& Obstacles(const ReportData& d) {
  return d.truth ? d.solids : d.perceived;
}

/// Height of the picture that leaves no empty bands above and below equal axes, px.
int TopViewHeight(const ReportData& d, int width) {
  constexpr int kFrame = 130;  // title, key, tics and labels
  Eigen::AlignedBox2d box;
  for (const auto& outlines : {Obstacles(d), d.movers, {d.chaser, d.target, d.geofence}})
    for (const Outline& o : outlines)
      for (const auto& p : o)
        if (p.allFinite()) box.extend(p);
  const double ratio = box.sizes().y() / std::max(box.sizes().x(), 1.0);
  return kFrame + std::clamp(static_cast<int>(ratio * width), 300, 1300);
}

void TopView(const ReportData& d, Script* s, const std::string& file) {
  const int width = 1100;
  Begin(s, file, d.title + ": top view", width, TopViewHeight(d, width));
  s->Block("solids", Obstacles(d), true);
  s->Block("crowns", d.crowns, true);
  s->Block("movers", d.movers, true);
  s->Block("predictions", d.predictions, false);
  s->Block("chaser", {d.chaser}, false);
  s->Block("target", {d.target}, false);
  s->Block("fence", {d.geofence}, true);
  std::vector<Outline> starts = {{d.chaser.front()}};
  if (!d.target.empty()) starts.push_back({d.target.front()});
  s->Block("ends", starts, false);
  s->Line("set size ratio -1; set xlabel 'x, east [m]'; set ylabel 'y, north [m]'");
  std::string plot = "plot ";
  if (!d.crowns.empty()) plot += "$crowns with lines lc rgb '#a9c9a4' title 'crowns', ";
  if (!Obstacles(d).empty())
    plot += fmt::format("$solids with filledcurves closed fc rgb '#b5bac2' title 'obstacles{}', ",
                        d.truth ? "" : " as perceived at the end");
  if (!d.movers.empty())
    plot += "$movers with lines dt 2 lc rgb '#9c27b0' title 'movers, every 5 s', ";
  if (!d.predictions.empty())
    plot += "$predictions with lines lc rgb '#f6c08a' title 'predictions', ";
  if (!d.geofence.empty()) plot += "$fence with lines dt 2 lc rgb '#c026b3' title 'geofence', ";
  plot += fmt::format("$chaser with lines lw 3 lc rgb '{}' title 'chaser', ", kChaser);
  if (!d.target.empty())
    plot += fmt::format("$target with lines lw 1.8 lc rgb '{}' title 'target', ", kTarget);
  plot += "$ends with points pt 7 ps 1.3 lc rgb '#202020' title 'start'";
  s->Line(plot);
}

void Distance(const ReportData& d, Script* s, const std::string& file) {
  Begin(s, file, d.title + ": distance to the target", 1000, 380);
  s->Block("distance", d.distance);
  s->Line("set xlabel " + Quoted(TimeWords(d)) + "; set ylabel 'distance [m]'; set yrange [0:*]");
  std::string plot = "plot ";
  if (d.truth)
    plot +=
        fmt::format("{} with lines dt 2 lc rgb '{}' title 'desired', ", d.desired_distance, kGrey);
  s->Line(plot +
          fmt::format("$distance with lines lw 2 lc rgb '{}' title 'chaser to target'", kChaser));
}

void Visibility(const ReportData& d, Script* s, const std::string& file) {
  Begin(s, file, d.title + ": visibility of the target", 1000, 380);
  s->Block("visible", d.visible);
  s->Block("share", d.visible_share);
  s->Line("set xlabel 'mission time [s]'; set ylabel 'share'; set yrange [0:1.08]");
  s->Line(
      fmt::format("plot $visible using 1:(1-$2) with fillsteps fc rgb '#e89a9a' title 'line of "
                  "sight blocked', $share with lines lw 1.6 lc rgb '{}' title 'visible share of "
                  "the target''s pixels'",
                  kTarget));
}

void Clearance(const ReportData& d, Script* s, const std::string& file) {
  Begin(s, file, d.title + ": clearance of the drone's sphere", 1000, 380);
  s->Block("clearance", d.clearance);
  s->Line("set xlabel 'mission time [s]'; set ylabel 'distance to the nearest solid [m]'");
  s->Line("set yrange [*<0:*]");
  s->Line(
      fmt::format("plot 0 with lines lw 1.5 lc rgb '#d02f2f' title 'touching', "
                  "$clearance with lines lw 2 lc rgb '{}' title 'clearance'",
                  kChaser));
}

void Pixels(const ReportData& d, Script* s, const std::string& file) {
  Begin(s, file, d.title + ": the target's centre in the image", 900, 570);
  s->Line("$pixels << EOD");
  for (size_t i = 0; i < d.pixel_u.t.size(); ++i)
    s->Line(fmt::format("{:.2f} {:.2f} {:.3f}", d.pixel_u.value[i], d.pixel_v.value[i],
                        d.pixel_u.t[i]));
  s->Line("EOD");
  s->Line(fmt::format("set xrange [0:{}]; set yrange [{}:0]; set size ratio {}", d.width_px,
                      d.height_px, static_cast<double>(d.height_px) / d.width_px));
  s->Line("set xlabel 'u [px]'; set ylabel 'v [px]'; set cblabel 'mission time [s]' offset 1.5");
  s->Line("set palette defined (0 '#440154', 1 '#3b528b', 2 '#21918c', 3 '#5ec962', 4 '#fde725')");
  s->Line("unset key");
  s->Line("plot $pixels using 1:2:3 with linespoints pt 7 ps 0.35 lw 0.6 lc palette");
}

/// Stretches of time, a row for each state of each lane.
void TimeLine(const ReportData& d, Script* s, const std::string& file) {
  std::vector<std::string> rows, lanes;
  const auto place = [](std::vector<std::string>* names, const std::string& name) {
    const auto found = std::find(names->begin(), names->end(), name);
    const auto at = static_cast<size_t>(found - names->begin());
    if (found == names->end()) names->push_back(name);
    return at;
  };
  std::string spans, tics;
  for (const ReportData::Span& span : d.spans) {
    const auto row = place(&rows, span.lane + " " + span.label), lane = place(&lanes, span.lane);
    spans += fmt::format("{:.3f} {:.3f} {} {}\n", span.from, span.to, row, Rgb(lane));
  }
  for (size_t i = 0; i < rows.size(); ++i)
    tics += fmt::format("{}{} {}", i ? ", " : "", Quoted(rows[i]), i);
  Begin(s, file, d.title + ": states", 1000, 110 + 24 * static_cast<int>(rows.size()));
  s->Line("$spans << EOD\n" + spans + "EOD");
  s->Line("set xlabel " + Quoted(TimeWords(d)) + "; set ytics noenhanced (" + tics +
          "); unset key");
  s->Line(fmt::format("set yrange [{}:-0.5]", static_cast<double>(rows.size()) - 0.5));
  s->Line("plot $spans using 1:3:1:2:($3-0.38):($3+0.38):4 with boxxyerror lc rgb variable");
}

struct Curve {
  std::string name;
  ReportData::Series series;
};

void Curves(const ReportData& d, Script* s, const std::string& file, const std::string& what,
            const std::string& unit, const std::vector<Curve>& curves) {
  Begin(s, file, d.title + ": " + what, 1000, 380);
  s->Line("set xlabel " + Quoted(TimeWords(d)) + "; set ylabel " + Quoted(unit));
  s->Line("set yrange [*<0:*]");
  std::string plot;
  for (size_t i = 0; i < curves.size(); ++i) {
    if (curves[i].series.t.empty()) continue;
    s->Block("curve" + std::to_string(i), curves[i].series);
    plot += fmt::format("{}$curve{} with lines lw 1.6 lc rgb {} title {}", plot.empty() ? "" : ", ",
                        i, Rgb(i), Quoted(curves[i].name));
  }
  s->Line("plot " + plot);
}

void Certificate(const ReportData& d, Script* s, const std::string& file) {
  Curves(d, s, file, "clearance that plans certify", "clearance [m]", {{"certified", d.certified}});
}

void Tracking(const ReportData& d, Script* s, const std::string& file) {
  Curves(d, s, file, "tracking", "distance from what is followed [m]",
         {{"tracking error", d.tracking_error}});
}

void Uncertainty(const ReportData& d, Script* s, const std::string& file) {
  Curves(d, s, file, "uncertainty of positions", "standard deviation, worst axis [m]",
         {{"own position", d.pose_sigma}, {"target", d.target_sigma}});
}

void Latency(const ReportData& d, Script* s, const std::string& file) {
  std::vector<Curve> curves;
  for (const auto& [channel, series] : d.latency) curves.push_back({channel, series});
  Curves(d, s, file, "latency", "age when logged [ms]", curves);
}

void Bars(Script* s, const std::vector<NamedValue>& bars, const std::string& label) {
  s->Line("$bars << EOD");
  for (size_t i = 0; i < bars.size(); ++i)
    s->Line(fmt::format("{} {:.5g} \"{}\"", i, bars[i].value, bars[i].name));
  s->Line("EOD");
  s->Line("set boxwidth 0.7; unset key; set yrange [0:*]");
  s->Line("set xtics rotate by -35 noenhanced; set ylabel " + Quoted(label));
  s->Line(fmt::format("set xrange [-0.6:{}]", static_cast<double>(bars.size()) - 0.4));
}

void Stages(const ReportData& d, Script* s, const std::string& file) {
  Begin(s, file, d.title + ": time spent per stage", 1000, 480);
  std::vector<NamedValue> means;
  for (const StageFigures& f : d.stages) means.push_back({f.process + " " + f.stage, f.mean_ms});
  Bars(s, means, "time per call [ms]");
  s->Line("set key on; set yrange [*:*]; set logscale y");
  s->Line("$p99 << EOD");
  for (size_t i = 0; i < d.stages.size(); ++i) s->Row(static_cast<double>(i), d.stages[i].p99_ms);
  s->Line("EOD");
  s->Line(
      fmt::format("plot $bars using 1:2:xtic(3) with boxes lc rgb '{}' title 'mean', "
                  "$p99 with points pt 9 ps 1.2 lc rgb '{}' title '99th percentile'",
                  kChaser, kTarget));
}

void Cpu(const ReportData& d, Script* s, const std::string& file) {
  Begin(s, file, d.title + ": processor time per process", 1000, 420);
  Bars(s, d.cpu_share, "share of one core [%]");
  s->Line(fmt::format("plot $bars using 1:2:xtic(3) with boxes lc rgb '{}'", kChaser));
}

}  // namespace

void WritePlots(const std::string& folder, const ReportData& d) {
  using Draw = void (*)(const ReportData&, Script*, const std::string&);
  const auto draw = [&](bool has_data, const char* name, Draw picture) {
    if (has_data)
      Picture(folder, name, [&](Script* s, const std::string& file) { picture(d, s, file); });
  };
  draw(!d.chaser.empty(), "top_view.png", TopView);
  draw(!d.truth && !d.spans.empty(), "timeline.png", TimeLine);
  draw(!d.distance.t.empty(), "distance.png", Distance);
  draw(!d.visible.t.empty(), "visibility.png", Visibility);
  draw(!d.clearance.t.empty(), "clearance.png", Clearance);
  draw(!d.pixel_u.t.empty(), "pixels.png", Pixels);
  draw(!d.truth && !d.certified.t.empty(), "certificate.png", Certificate);
  draw(!d.tracking_error.t.empty(), "tracking.png", Tracking);
  draw(!d.pose_sigma.t.empty() || !d.target_sigma.t.empty(), "uncertainty.png", Uncertainty);
  draw(!d.latency.empty(), "latency.png", Latency);
  draw(!d.stages.empty(), "stages.png", Stages);
  draw(!d.cpu_share.empty(), "cpu.png", Cpu);
}

}  // namespace chase::logs
