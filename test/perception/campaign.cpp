// perception_campaign: flies perception through the simulator's worlds on many seeds and prints its
// figures against the truth. Not part of ctest: it takes minutes.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "common/config/config.h"
#include "common/config/version.h"
#include "score.h"
#include "show.h"

namespace chase::perception_stage {
namespace {

struct Arguments {
  std::vector<std::string> scenarios = {"gym", "forest"};
  uint64_t first = 1, count = 20;
  StageOptions stage;
  std::string config, trace, picture;
  double picture_at = 1.0;
  bool each = false;
};

void Print(const std::string& name, const Score& s) {
  fmt::print(
      "{:<12} {:6.4f} {:7.5f} {:6.3f} {:6.3f} {:6.2f} {:5.3f} {:6.2f} {:5.3f} {:5d} {:5.2f} "
      "{:5.2f} {:5.2f} {:5.2f} {:4d} {:5d} {:5.2f} {:5.2f}\n",
      name, s.recall(), s.precision(), s.rms(), s.p99(), s.nees(), s.coverage(), s.hidden_nees(),
      s.hidden_coverage(), s.occlusions(), s.said_max(), s.found_quantile(0.5),
      s.found_quantile(0.95), s.found_max(), s.wrong_after(), s.lost(), s.ms_p50(), s.ms_p99());
  std::fflush(stdout);
}

/// Reliability of the published existence: of the frames in each tenth, what was said and what was.
void PrintReliability(const Score& s) {
  fmt::print(
      "existence: frames, mean said, share within 0.5 m; expected calibration error {:.4f}\n",
      s.calibration_error());
  for (const auto& b : s.reliability())
    if (b.frames > 0.0)
      fmt::print("{:11.0f} {:6.3f} {:6.3f}\n", b.frames, b.expected / b.frames, b.there / b.frames);
}

void Trace(const std::string& file, const std::vector<Outcome>& flight) {
  std::ofstream out(file);
  out << "t,visible,range,state,error,nees,box,score,points,ex,ey,ez,sx,sy,sz,x,y,z,note\n";
  for (const auto& o : flight) {
    const Eigen::Vector3d e = o.estimate.p_WT - o.truth;
    const Eigen::Vector3d s = o.estimate.covariance.diagonal().cwiseSqrt();
    out << fmt::format(
        "{:.2f},{:.2f},{:.2f},{},{:.3f},{:.2f},{:.0f},{:.2f},{},{:.3f},{:.3f},{:.3f},{:.3f},{:.3f},"
        "{:.3f},{:.2f},{:.2f},{:.2f},{}\n",
        o.t, o.visible_share, o.range, static_cast<int>(o.estimate.state), e.norm(),
        e.dot(o.estimate.covariance.ldlt().solve(e)), o.estimate.box.width, o.estimate.score,
        o.estimate.n_points, e.x(), e.y(), e.z(), s.x(), s.y(), s.z(), o.truth.x(), o.truth.y(),
        o.truth.z(), o.estimate.note);
  }
}

void Run(const Arguments& a) {
  fmt::print(
      "world        recall precisn   rms_m  p99_m   nees in_95  nees_h in_h  hidings said  "
      "found50 95 max wrong lost ms50 ms99\n");
  for (const auto& name : a.scenarios) {
    Score all;
    for (uint64_t seed = a.first; seed < a.first + a.count; ++seed) {
      StageOptions options = a.stage;
      options.scenario = "deploy/scenarios/" + name + ".yaml";
      options.seed = seed;
      const Stage stage(options);
      auto config = ConfigFor(stage.scenario());
      if (!a.config.empty()) config::Load(a.config, &config);
      if (!a.picture.empty()) {
        Show show(stage, config.rig);
        show.Advance(a.picture_at);
        cv::imwrite(fmt::format("{}/{}-{}.png", a.picture, name, seed),
                    show.Image(a.picture_at).bgr);
        continue;
      }
      const auto flight = Fly(stage, config);
      all.Add(flight);
      if (!a.trace.empty()) Trace(fmt::format("{}/{}-{}.csv", a.trace, name, seed), flight);
      if (!a.each) continue;
      Score one;
      one.Add(flight);
      Print(fmt::format("{}-{}", name, seed), one);
    }
    Print(name, all);
    PrintReliability(all);
  }
}

}  // namespace
}  // namespace chase::perception_stage

int main(int argc, char** argv) {
  chase::perception_stage::Arguments a;
  CLI::App app("Flies perception through the simulator's worlds and scores it.");
  chase::config::AddVersion(&app);
  app.add_option("scenarios", a.scenarios, "names in deploy/scenarios");
  app.add_option("--first", a.first, "first seed");
  app.add_option("--count", a.count, "seeds");
  app.add_option("--duration", a.stage.duration, "of each flight, s");
  app.add_option("--light", a.stage.light, "share of the day's");
  app.add_option("--config", a.config, "overrides of perception's config");
  app.add_option("--trace", a.trace, "folder for one CSV a flight");
  app.add_option("--picture", a.picture, "folder for one frame a flight, instead of flying");
  app.add_option("--at", a.picture_at, "time of that frame, s");
  app.add_flag("--each", a.each, "a line for every flight");
  app.add_flag("--absent", a.stage.absent, "no target, nor a thing just like it: only look-alikes");
  app.add_flag("!--no-distractors", a.stage.distractors);
  app.add_flag("!--no-screens", a.stage.screens);
  try {
    app.parse(argc, argv);
    chase::perception_stage::Run(a);
    return 0;
  } catch (const CLI::Success& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    fmt::print(stderr, "perception_campaign: {}; see perception_campaign --help\n", e.what());
  } catch (const std::exception& e) {
    fmt::print(stderr, "perception_campaign: {}\n", e.what());
  }
  return 1;
}
