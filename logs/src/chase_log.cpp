#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <stdexcept>

#include "logs/src/diff.h"
#include "logs/src/export.h"
#include "logs/src/import.h"
#include "logs/src/info.h"
#include "logs/src/migrate.h"
#include "logs/src/verify.h"

namespace {

using namespace chase::logs;

struct Arguments {
  std::string in, out, other, format, channel;
  std::vector<std::string> ignore;
  double tolerance = 0.0;
  bool tum = false, csv = false, mcap = false;
};

/// What is written is not what is read: nothing is lost by a slip.
void RefuseSame(const std::string& in, const std::string& out) {
  std::error_code none;                                   // neither need exist
  for (const std::string& written : {out, out + ".tmp"})  // bus::PartFile's name meanwhile
    if (std::filesystem::equivalent(in, written, none))
      throw std::runtime_error(written + " is the file that is read; name another for the output");
}

void AddInfo(CLI::App* app, Arguments* a) {
  auto* sub = app->add_subcommand("info", "One line per channel: type, count, rate, bytes, times.");
  sub->add_option("LOG", a->in, "LCM log")->required();
  sub->callback([a] { std::fputs(Format(Describe(a->in)).c_str(), stdout); });
}

void RunImport(const Arguments& a) {
  RefuseSame(a.in, a.out);
  const int sweeps = a.format == "vlp16" ? ImportVlp16(a.in, a.out) : ImportKitti16(a.in, a.out);
  std::printf("%s: %d sweeps\n", a.out.c_str(), sweeps);
}

void AddImport(CLI::App* app, Arguments* a) {
  auto* sub = app->add_subcommand("import", "Turns a recording into a log of LIDAR_SCAN.");
  sub->add_option("FORMAT", a->format,
                  "vlp16: raw 1206-byte packets or .pcap; kitti16: 16-ring KITTI .bin or .bin.xz")
      ->required()
      ->check(CLI::IsMember({"vlp16", "kitti16"}));
  sub->add_option("FILE", a->in, "recording")->required();
  sub->add_option("OUT", a->out, "LCM log to write")->required();
  sub->callback([a] { RunImport(*a); });
}

void RunExport(const Arguments& a) {
  RefuseSame(a.in, a.out);
  if (a.tum)
    std::printf("%s: %ld poses\n", a.out.c_str(),
                ExportTum(a.in, a.out, a.channel.empty() ? "POSE" : a.channel));
  else if (a.mcap)
    std::printf("%s: %ld messages\n", a.out.c_str(), ExportMcap(a.in, a.out, a.channel));
  else
    std::printf("%s: %d files\n", a.out.c_str(), ExportCsv(a.in, a.out, a.channel));
}

void AddExport(CLI::App* app, Arguments* a) {
  auto* sub = app->add_subcommand("export", "Writes a log in a format that others read.");
  auto* format = sub->add_option_group("format");
  format->add_flag("--tum", a->tum,
                   "trajectory t x y z qx qy qz qw of POSE, or --channel TRUTH or TARGET");
  format->add_flag("--csv", a->csv, "OUT is a folder: one file per channel");
  format->add_flag("--mcap", a->mcap,
                   "JSON messages for Foxglove; clouds and images in its schemas");
  format->require_option(1);
  sub->add_option("--channel", a->channel,
                  "this channel only; --csv leaves out clouds and images unless they are named");
  sub->add_option("LOG", a->in, "LCM log")->required();
  sub->add_option("OUT", a->out, "file or folder to write")->required();
  sub->callback([a] { RunExport(*a); });
}

void RunMigrate(const Arguments& a) {
  RefuseSame(a.in, a.out);
  std::fputs(Format(MigrateLog(a.in, a.out)).c_str(), stdout);
}

void AddMigrate(CLI::App* app, Arguments* a) {
  auto* sub = app->add_subcommand(
      "migrate", "Brings a log that an older version recorded to today's messages.");
  sub->add_option("OLD", a->in, "LCM log")->required();
  sub->add_option("NEW", a->out, "LCM log to write")->required();
  sub->callback([a] { RunMigrate(*a); });
}

/// Any number compares false with NaN, so that CLI's own ranges take it.
std::string ToleranceProblem(const std::string& text) {
  double value = 0.0;
  const bool good = CLI::detail::lexical_cast(text, value) && value >= 0.0 && std::isfinite(value);
  return good ? "" : text + " is no tolerance, 0 or above";
}

void AddDiff(CLI::App* app, Arguments* a, int* exit_code) {
  auto* sub =
      app->add_subcommand("diff", "Compares two logs field by field; exit 1 if they differ.");
  sub->add_option("A", a->in, "LCM log")->required();
  sub->add_option("B", a->other, "LCM log")->required();
  sub->add_option("--tolerance", a->tolerance,
                  "numbers this close are the same: absolute below 1, relative above")
      ->check(ToleranceProblem);
  sub->add_option("--ignore", a->ignore,
                  "CHANNEL.field left out, shell patterns allowed; CHANNEL alone: all of it");
  sub->callback([a, exit_code] {
    const auto differences = Diff(a->in, a->other, a->ignore, a->tolerance);
    std::fputs(differences.empty() ? "no difference\n" : Format(differences).c_str(), stdout);
    *exit_code = differences.empty() ? 0 : 1;
  });
}

void AddVerify(CLI::App* app, Arguments* a, int* exit_code) {
  auto* sub = app->add_subcommand(
      "verify",
      "Checks the proofs of every plan in exact arithmetic; exit 1 if one does not hold.");
  sub->add_option("FLIGHT", a->in, "LCM log, or the folder of a flight")->required();
  sub->callback([a, exit_code] {
    namespace fs = std::filesystem;
    const std::string log =
        fs::is_directory(a->in) ? (fs::path(a->in) / "flight.lcm").string() : a->in;
    const Verification verification = Verify(log);
    std::fputs(Format(verification).c_str(), stdout);
    *exit_code = verification.Holds() ? 0 : 1;
  });
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app{"Shows, imports, exports, compares, migrates and verifies LCM logs."};
  app.name("chase-log");
  app.set_version_flag("--version", CHASE_VERSION);
  app.require_subcommand(1);
  Arguments arguments;
  int exit_code = 0;
  AddInfo(&app, &arguments);
  AddVerify(&app, &arguments, &exit_code);
  AddImport(&app, &arguments);
  AddExport(&app, &arguments);
  AddDiff(&app, &arguments, &exit_code);
  AddMigrate(&app, &arguments);
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);
    std::fprintf(stderr, "chase-log: %s; see chase-log --help\n", e.what());
    return 1;
  } catch (const std::exception& e) {
    std::fprintf(stderr, "chase-log: %s\n", e.what());
    return dynamic_cast<const BadOption*>(&e) != nullptr ? 2 : 1;
  }
  return exit_code;
}
