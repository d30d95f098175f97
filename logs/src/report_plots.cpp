#include "logs/src/report_plots.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <filesystem>
#include <iterator>

#include "logs/src/gnuplot.h"

namespace chase::logs {
namespace {

constexpr const char* kChaser = "#1f5fa8";
constexpr const char* kTarget = "#e8710a";
constexpr const char* kGrey = "#8a8f98";

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
  void Row(double a, double b) {
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

/// Height of the picture that leaves no empty bands above and below equal axes, px.
int TopViewHeight(const ReportData& d, int width) {
  constexpr int kFrame = 130;  // title, key, tics and labels
  Eigen::AlignedBox2d box;
  for (const auto& outlines : {d.solids, d.movers, {d.chaser, d.target}})
    for (const Outline& o : outlines)
      for (const auto& p : o) box.extend(p);
  const double ratio = box.sizes().y() / std::max(box.sizes().x(), 1.0);
  return kFrame + std::clamp(static_cast<int>(ratio * width), 300, 1300);
}

void TopView(const ReportData& d, Script* s, const std::string& file) {
  const int width = 1100;
  Begin(s, file, d.title + ": top view", width, TopViewHeight(d, width));
  s->Block("solids", d.solids, true);
  s->Block("crowns", d.crowns, true);
  s->Block("movers", d.movers, true);
  s->Block("predictions", d.predictions, false);
  s->Block("chaser", {d.chaser}, false);
  s->Block("target", {d.target}, false);
  s->Block("ends", {{d.chaser.front()}, {d.target.front()}}, false);
  s->Line("set size ratio -1; set xlabel 'x, east [m]'; set ylabel 'y, north [m]'");
  std::string plot = "plot ";
  if (!d.crowns.empty()) plot += "$crowns with lines lc rgb '#a9c9a4' title 'crowns', ";
  if (!d.solids.empty())
    plot += "$solids with filledcurves closed fc rgb '#b5bac2' title 'obstacles', ";
  if (!d.movers.empty())
    plot += "$movers with lines dt 2 lc rgb '#9c27b0' title 'movers, every 5 s', ";
  if (!d.predictions.empty())
    plot += "$predictions with lines lc rgb '#f6c08a' title 'predictions', ";
  plot += fmt::format("$chaser with lines lw 3 lc rgb '{}' title 'chaser', ", kChaser);
  plot += fmt::format("$target with lines lw 1.8 lc rgb '{}' title 'target', ", kTarget);
  plot += "$ends with points pt 7 ps 1.3 lc rgb '#202020' title 'start'";
  s->Line(plot);
}

void Distance(const ReportData& d, Script* s, const std::string& file) {
  Begin(s, file, d.title + ": distance to the target", 1000, 380);
  s->Block("distance", d.distance);
  s->Line("set xlabel 'mission time [s]'; set ylabel 'distance [m]'; set yrange [0:*]");
  s->Line(
      fmt::format("plot {} with lines dt 2 lc rgb '{}' title 'desired', "
                  "$distance with lines lw 2 lc rgb '{}' title 'chaser to target'",
                  d.desired_distance, kGrey, kChaser));
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
  draw(!d.distance.t.empty(), "distance.png", Distance);
  draw(!d.visible.t.empty(), "visibility.png", Visibility);
  draw(!d.clearance.t.empty(), "clearance.png", Clearance);
  draw(!d.pixel_u.t.empty(), "pixels.png", Pixels);
  draw(!d.stages.empty(), "stages.png", Stages);
  draw(!d.cpu_share.empty(), "cpu.png", Cpu);
}

}  // namespace chase::logs
