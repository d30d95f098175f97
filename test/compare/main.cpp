// chase-compare: flies planners through scenarios and sets their figures side by side.

#include <CLI/CLI.hpp>
#include <cstdio>
#include <stdexcept>

#include "common/config/version.h"
#include "deploy/campaign/process.h"
#include "test/compare/campaign.h"
#include "test/compare/results.h"

namespace {

using namespace chase::compare;

struct Options {
  Arguments campaign;
  std::string fly, result;
  bool list = false;
};

void Execute(const Options& options) {
  const Arguments& arguments = options.campaign;
  if (!options.fly.empty()) {
    if (arguments.planners.size() != 1 || options.result.empty())
      throw std::runtime_error("--fly takes one planner in --planners and a file in --result");
    return Fly({options.fly, arguments.planners.front(), options.result});
  }
  const std::vector<Flight> flights = FlightsOf(arguments);
  const auto jobs = Jobs(flights);
  if (options.list) {
    for (const auto& job : jobs)
      std::printf("%s\n", chase::campaign::ShellLine(job.command).c_str());
    return;
  }
  chase::campaign::MakeFolder(arguments.out);
  chase::campaign::RunOptions run;
  run.jobs = arguments.jobs;
  run.quiet = arguments.quiet;
  chase::campaign::Run(jobs, run);
  WriteResults(flights, arguments);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Flies planners through scenarios and sets their figures side by side.",
               "chase-compare");
  chase::config::AddVersion(&app);
  Options o;
  app.add_option("--planners", o.campaign.planners,
                 "names, such as chase,penin_style; name:7 is parameter set 7, name:all every one "
                 "(default: chase, the three rivals, reference)")
      ->delimiter(',');
  app.add_option("--scenarios", o.campaign.scenarios,
                 "S1 to S12, or scenario files (default: the twelve)")
      ->delimiter(',');
  app.add_option("--jobs", o.campaign.jobs, "flights at a time (default 1)")
      ->check(CLI::Range(1, 1024));
  app.add_option("--out", o.campaign.out, "folder of the results (default compare)");
  app.add_flag("--quiet", o.campaign.quiet, "no progress bar");
  app.add_flag("!--no-pictures", o.campaign.pictures, "tables only");
  auto* list = app.add_flag("--list", o.list, "print one command per flight and fly nothing");
  auto* fly = app.add_option("--fly", o.fly, "one flight of this scenario in this process");
  list->excludes(fly);
  app.add_option("--result", o.result, "file for the result of --fly")->needs(fly);
  try {
    app.parse(argc, argv);
    Execute(o);
    return 0;
  } catch (const CLI::Success& e) {
    return app.exit(e);
  } catch (const CLI::ParseError& e) {
    std::fprintf(stderr, "chase-compare: %s; see chase-compare --help\n", e.what());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "chase-compare: %s\n", e.what());
  }
  return 1;
}
