#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <fstream>
#include <stdexcept>

#include "common/config/version.h"
#include "deploy/worlds/picture.h"
#include "deploy/worlds/worlds.h"

namespace chase::worlds {
namespace {

struct Arguments {
  std::string kind, out, picture;
  int64_t seed = 1;
  Options options;
};

void Write(const std::string& file, const std::string& text) {
  std::ofstream out(file);
  if (!(out << text) || !out.flush())
    throw std::runtime_error(file + ": cannot be written; name a file in an existing folder");
}

int Run(const Arguments& a) {
  if (a.kind == "all") {
    if (a.picture.empty()) throw std::runtime_error("all: give --picture FILE.png as well");
    SaveMontage(static_cast<uint64_t>(a.seed), a.options, a.picture);
    return 0;
  }
  const auto world = MakeWorld(a.kind, static_cast<uint64_t>(a.seed), a.options);
  if (!a.picture.empty()) SavePicture(world, a.picture);
  if (!a.out.empty()) Write(a.out, WorldText(world));
  if (a.picture.empty() && a.out.empty()) fmt::print("{}", WorldText(world));
  return 0;
}

std::string KindList() {
  std::string text = "Kinds:\n";
  for (const Kind& kind : Kinds()) text += fmt::format("  {:<10}{}\n", kind.name, kind.sentence);
  return text + "  all       A picture of one of each kind, for --picture.";
}

/// Any number compares false with NaN, so that CLI::Range takes it.
std::string DurationProblem(const std::string& text) {
  double t = 0.0;
  if (CLI::detail::lexical_cast(text, t) && t >= 5.0 && t <= 600.0) return "";
  return text + " is no duration, 5 to 600 s";
}

void AddOptions(CLI::App* app, Arguments* a) {
  app->add_option("kind", a->kind, "kind of world, see below")->required();
  app->add_option("--seed", a->seed, "of the world (default 1)")
      ->check(CLI::Range(int64_t{0}, int64_t{2147483647}));
  app->add_option("--out", a->out, "scenario file to write (default: standard output)");
  app->add_option("--picture", a->picture, "PNG to write: the world from above");
  app->add_option("--duration", a->options.duration, "of the mission, s (default 45)")
      ->check(DurationProblem);
  app->add_flag("--hidden-start", a->options.hidden_start,
                "the chaser looks away from the target at the start, and the target waits");
  app->footer(KindList());
}

}  // namespace
}  // namespace chase::worlds

/// Writes a random world as a scenario file. Exit codes: 0 written, 1 bad use.
int main(int argc, char** argv) {
  CLI::App app("Writes a random world as a scenario file.", "chase-world");
  chase::config::AddVersion(&app);
  chase::worlds::Arguments arguments;
  chase::worlds::AddOptions(&app, &arguments);
  try {
    app.parse(argc, argv);
    return chase::worlds::Run(arguments);
  } catch (const CLI::Success& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    fmt::print(stderr, "chase-world: {}; see chase-world --help\n", e.what());
  } catch (const std::exception& e) {
    fmt::print(stderr, "chase-world: {}\n", e.what());
  }
  return 1;
}
