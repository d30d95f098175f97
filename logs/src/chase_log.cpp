#include <fmt/format.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <stdexcept>
#include <utility>

#include "common/config/config.h"
#include "common/config/version.h"
#include "common/world/rig_file.h"
#include "logs/src/copy.h"
#include "logs/src/diff.h"
#include "logs/src/export.h"
#include "logs/src/flight_samples.h"
#include "logs/src/identified_files.h"
#include "logs/src/identify.h"
#include "logs/src/import.h"
#include "logs/src/info.h"
#include "logs/src/migrate.h"
#include "logs/src/output.h"
#include "logs/src/verify.h"

namespace {

using namespace chase::logs;

constexpr std::chrono::milliseconds kProgressPeriod(200);

struct Arguments {
  std::string in, out, other, format, channel, config, rig, folder;
  std::vector<std::string> ignore, files;
  Selection selection;
  double tolerance = 0.0;
  double radius = 0.37, sigmas = 2.0;  // of planning's defaults
  bool tum = false, csv = false, mcap = false, long_form = false, jpeg = false;
};

/// Says on stderr how far the work is, where that is a terminal, and in the end what of the log
/// could not be read.
Watch Progress() {
  using Clock = std::chrono::steady_clock;
  return [next = Clock::now() + kProgressPeriod, told = false](const LogReader& log) mutable {
    const bool terminal = isatty(STDERR_FILENO) != 0;
    if (terminal && Clock::now() >= next) {
      next = Clock::now() + kProgressPeriod;
      std::fprintf(stderr, "\r%s: %3.0f %%", log.file().c_str(),
                   100.0 * static_cast<double>(log.position()) / static_cast<double>(log.size()));
    }
    if (!log.AtEnd() || std::exchange(told, true)) return;
    if (terminal) std::fputs("\r\033[K", stderr);
    for (const Damage& d : log.damage())
      std::fprintf(stderr, "%s: %s\n", log.file().c_str(), Format(d).c_str());
  };
}

/// Any number compares false with NaN, so that CLI's own ranges take it.
bool IsNumber(const std::string& text) {
  double value = 0.0;
  return CLI::detail::lexical_cast(text, value) && value >= 0.0 && std::isfinite(value);
}

std::string ToleranceProblem(const std::string& text) {
  return IsNumber(text) ? "" : text + " is no tolerance, 0 or above";
}

std::string TimeProblem(const std::string& text) {
  return IsNumber(text) ? "" : text + " is no time in s, 0 or above";
}

std::string RadiusProblem(const std::string& text) {
  double value = 0.0;
  const bool positive = IsNumber(text) && CLI::detail::lexical_cast(text, value) && value > 0.0;
  return positive ? "" : text + " is no radius in m, above 0";
}

std::string SigmasProblem(const std::string& text) {
  return IsNumber(text) ? "" : text + " is no number of deviations, 0 or above";
}

/// What is written is not what is read: nothing is lost by a slip.
void RefuseSame(const std::string& in, const std::string& out) {
  std::error_code none;                                   // neither need exist
  for (const std::string& written : {out, out + ".tmp"})  // bus::PartFile's name meanwhile
    if (std::filesystem::equivalent(in, written, none))
      throw std::runtime_error(written + " is the file that is read; name another for the output");
}

void AddLog(CLI::App* sub, const char* name, std::string* log) {
  sub->add_option(name, *log, "LCM log, or the folder of a flight")->required()->transform(LogOf);
}

void AddInfo(CLI::App* app, Arguments* a) {
  auto* sub = app->add_subcommand("info", "One line per channel: type, count, rate, bytes, times.");
  AddLog(sub, "LOG", &a->in);
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

/// What a calibration file, or one of perception, says of the rig.
chase::world::Rig RigIn(const std::string& file, bool named) {
  const YAML::Node all = chase::config::detail::ParseFile(file);
  YAML::Node part;
  if (all.IsMap() && all["rig"].IsDefined())
    part["rig"] = all["rig"];
  else if (named)
    throw std::runtime_error(file +
                             ": has no key rig; name a calibration file or a perception.yaml");
  chase::world::RigFile rig;
  chase::config::LoadText(YAML::Dump(part), file, &rig);
  return rig.rig;
}

void RunMcap(const Arguments& a, Notes* notes) {
  namespace fs = std::filesystem;
  const fs::path flown = fs::path(a.in).parent_path() / "perception.yaml";
  const std::string file = !a.rig.empty() ? a.rig : fs::exists(flown) ? flown.string() : "";
  const chase::world::Rig rig = file.empty() ? chase::world::Rig() : RigIn(file, !a.rig.empty());
  const long messages =
      ExportMcap(a.in, a.out, a.channel, {a.jpeg, rig}, !a.rig.empty(), Progress(), notes);
  std::printf("%s: %ld messages, with %s\n", a.out.c_str(), messages,
              file.empty() ? "the default rig" : ("the rig of " + file).c_str());
}

void RunExport(const Arguments& a) {
  RefuseSame(a.in, a.out);
  const auto only_with = [&](bool given, const char* option, bool fits, const char* format) {
    const char* chosen = a.tum ? "--tum" : a.csv ? "--csv" : "--mcap";
    if (given && !fits)
      throw BadOption(fmt::format("{}: does nothing with {}; leave it out, or export {}", option,
                                  chosen, format));
  };
  only_with(a.long_form, "--long", a.csv, "--csv");
  only_with(a.jpeg, "--jpeg", a.mcap, "--mcap");
  only_with(!a.rig.empty(), "--rig", a.mcap, "--mcap");
  Notes notes;
  if (a.tum) {
    const std::string channel = a.channel.empty() ? "POSE" : a.channel;
    const long poses = ExportTum(a.in, a.out, channel, Progress(), &notes);
    std::printf("%s: %ld pose%s\n", a.out.c_str(), poses, poses == 1 ? "" : "s");
  } else if (a.mcap) {
    RunMcap(a, &notes);
  } else {
    const int files = ExportCsv(a.in, a.out, a.channel, a.long_form, Progress(), &notes);
    std::printf("%s: %d file%s\n", a.out.c_str(), files, files == 1 ? "" : "s");
  }
  for (const std::string& note : notes)
    std::fprintf(stderr, "%s: %s\n", a.in.c_str(), note.c_str());
}

void AddExport(CLI::App* app, Arguments* a) {
  auto* sub = app->add_subcommand("export", "Writes a log in a format that others read.");
  auto* format = sub->add_option_group("format");
  format->add_flag("--tum", a->tum,
                   "trajectory t x y z qx qy qz qw of POSE, or --channel TRUTH or TARGET");
  format->add_flag("--csv", a->csv, "OUT is a folder: one file per channel");
  format->add_flag("--mcap", a->mcap,
                   "protobuf for Foxglove: all fields, and its own schemas where they fit");
  format->require_option(1);
  sub->add_flag("--jpeg", a->jpeg, "--mcap: images as JPEG, with loss, at a twentieth of the size");
  sub->add_option("--rig", a->rig,
                  "--mcap: calibration file of the rig that flew, or perception's (default: the "
                  "perception.yaml beside the log, else the default rig)");
  sub->add_flag("--long", a->long_form,
                "--csv: a row for every element: event_utime, seq, field, index, value");
  sub->add_option("--channel", a->channel,
                  "this channel only; --csv leaves out clouds and images unless they are named");
  AddLog(sub, "LOG", &a->in);
  sub->add_option("OUT", a->out, "file or folder to write")->required();
  sub->callback([a] { RunExport(*a); });
}

void Say(const Arguments& a, const Copied& copied) {
  std::printf("%s: %s", a.out.c_str(), Format(copied).c_str());
}

void RunCopy(const Arguments& a, const char* cure) {
  const Selection none, &s = a.selection;
  if (s.from == none.from && s.to == none.to && s.keep.empty() && s.drop.empty())
    throw BadOption(std::string("nothing is selected, this would copy the log; give ") + cure);
  if (s.to <= s.from)
    throw BadOption(
        fmt::format("--to {:g}: is not after --from {:g}; give a later time", s.to, s.from));
  RefuseSame(a.in, a.out);
  Say(a, CopySelected(a.in, a.out, s, Progress()));
}

CLI::App* AddInOut(CLI::App* app, Arguments* a, const char* name, const char* description) {
  auto* sub = app->add_subcommand(name, description);
  AddLog(sub, "LOG", &a->in);
  sub->add_option("OUT", a->out, "LCM log to write")->required();
  return sub;
}

void AddCut(CLI::App* app, Arguments* a) {
  auto* sub = AddInOut(app, a, "cut", "Copies a stretch of time of a log.");
  sub->add_option("--from", a->selection.from, "s after the log's first event (default: 0)")
      ->check(TimeProblem);
  sub->add_option("--to", a->selection.to, "s after the log's first event (default: its end)")
      ->check(TimeProblem);
  sub->callback([a] { RunCopy(*a, "--from or --to"); });
}

void AddFilter(CLI::App* app, Arguments* a) {
  auto* sub = AddInOut(app, a, "filter", "Copies some channels of a log.");
  sub->add_option("--keep", a->selection.keep, "channels, shell patterns allowed (default: all)")
      ->delimiter(',');
  sub->add_option("--drop", a->selection.drop, "channels to leave out, shell patterns allowed")
      ->delimiter(',');
  sub->callback([a] { RunCopy(*a, "--keep or --drop"); });
}

void AddRepair(CLI::App* app, Arguments* a) {
  auto* sub = AddInOut(app, a, "repair",
                       "Copies all that can be read of a damaged log and says what was dropped.");
  sub->callback([a] {
    RefuseSame(a->in, a->out);
    Say(*a, Repair(a->in, a->out, Progress()));
  });
}

void AddMerge(CLI::App* app, Arguments* a) {
  auto* sub = app->add_subcommand(
      "merge", "Joins logs in the order of their stamps; what several hold is written once.");
  sub->add_option("FILES", a->files,
                  "LOG LOG... OUT: two logs or more, or folders of flights, and the log to write")
      ->required()
      ->expected(3, 1000);
  sub->callback([a] {
    a->out = a->files.back();
    a->files.pop_back();
    for (std::string& in : a->files) RefuseSame(in = LogOf(in), a->out);
    Say(*a, Merge(a->files, a->out, Progress()));
  });
}

void RunMigrate(const Arguments& a) {
  RefuseSame(a.in, a.out);
  std::fputs(Format(MigrateLog(a.in, a.out)).c_str(), stdout);
}

void AddMigrate(CLI::App* app, Arguments* a) {
  auto* sub = app->add_subcommand(
      "migrate", "Brings a log that an older version recorded to today's messages.");
  AddLog(sub, "OLD", &a->in);
  sub->add_option("NEW", a->out, "LCM log to write")->required();
  sub->callback([a] { RunMigrate(*a); });
}

void AddDiff(CLI::App* app, Arguments* a, int* exit_code) {
  auto* sub = app->add_subcommand(
      "diff",
      "Compares the channels that two logs have in common field by field; exit 1 if they differ, 2 "
      "if that cannot be told.");
  AddLog(sub, "A", &a->in);
  AddLog(sub, "B", &a->other);
  sub->add_option("--tolerance", a->tolerance,
                  "numbers this close are the same: absolute below 1, relative above")
      ->check(ToleranceProblem);
  sub->add_option("--ignore", a->ignore,
                  "CHANNEL.field left out, shell patterns allowed; CHANNEL alone: all of it");
  sub->callback([a, exit_code] {
    const auto differences = Diff(a->in, a->other, a->ignore, a->tolerance, Progress());
    std::fputs(Format(differences).c_str(), stdout);
    *exit_code = differences.channels.empty() ? 0 : 1;
  });
}

void RunIdentify(const Arguments& a) {
  const std::string& log = a.in;
  RefuseSame(log, a.out);
  if (!a.config.empty() && a.out.empty())
    throw BadOption("--config: does nothing without --out; name the file to write");
  if (!a.out.empty()) RequireWritable(a.out);
  const auto identified = Identify(ReadSamples(log, Progress()));
  if (!identified)
    throw std::runtime_error(log +
                             ": less than 5 s of it are flight by plans with a good pose, "
                             "half a second after each beginning left out; fly for longer");
  std::fputs(Format(*identified).c_str(), stdout);
  if (!a.folder.empty()) {
    const auto flown_by = Describe(log).configurations;
    const auto fcu = flown_by.find("fcu");
    std::fputs(UpdateFiles(*identified, fcu == flown_by.end() ? "" : fcu->second, a.folder).c_str(),
               stdout);
  }
  if (a.out.empty()) return;
  const std::string text = ControlFile(*identified, log, a.config);
  if (text.empty())
    throw std::runtime_error(log + ": shows nothing that control has; " + a.out +
                             " is not written");
  WriteFile(a.out, text);
}

void AddIdentify(CLI::App* app, Arguments* a) {
  auto* sub = app->add_subcommand(
      "identify", "Drag, thrust curve and delays of a vehicle from a flight, with uncertainties.");
  AddLog(sub, "FLIGHT", &a->in);
  sub->add_option("--out", a->out,
                  "file to write for chase-control --config: what the flight shows");
  sub->add_option("--config", a->config,
                  "control's file today: an axis whose drag the flight does not show is kept");
  sub->add_option("--update", a->folder,
                  "folder of control.yaml, planning.yaml and fcu.yaml, such as /etc/chase: sets "
                  "there what the flight shows, all else stays");
  sub->callback([a] { RunIdentify(*a); });
}

void AddVerify(CLI::App* app, Arguments* a, int* exit_code) {
  auto* sub = app->add_subcommand(
      "verify",
      "Checks the proofs of every plan in exact arithmetic; exit 1 if one does not hold, 2 if "
      "that cannot be told.");
  AddLog(sub, "FLIGHT", &a->in);
  sub->add_option("--radius", a->radius, "least that a plan must claim: sphere and tube, m")
      ->check(RadiusProblem)
      ->capture_default_str();
  sub->add_option("--sigmas", a->sigmas, "least deviations that a plan must claim")
      ->check(SigmasProblem)
      ->capture_default_str();
  sub->callback([a, exit_code] {
    const Verification verification = Verify(a->in, a->radius, a->sigmas);
    std::fputs(Format(verification).c_str(), stdout);
    *exit_code = !verification.refuted.empty() ? 1 : verification.Told() ? 0 : 2;
  });
}

/// The exit code where there is no answer; `otherwise` where 1 is none.
int Trouble(const CLI::App& app, int otherwise) {
  return app.got_subcommand("diff") || app.got_subcommand("verify") ? 2 : otherwise;
}

}  // namespace

/// Exit codes: 0 done; 1 bad use or a file that cannot be read or written; 2 an option that would
/// do nothing. Of diff and verify 1 is an answer, so that what keeps them from one is 2.
int main(int argc, char** argv) {
  CLI::App app{
      "Shows, imports, exports, compares, cuts, merges, repairs, migrates and verifies LCM logs, "
      "and "
      "identifies vehicles by them."};
  app.name("chase-log");
  chase::config::AddVersion(&app);
  app.require_subcommand(1);
  Arguments arguments;
  int exit_code = 0;
  AddInfo(&app, &arguments);
  AddVerify(&app, &arguments, &exit_code);
  AddIdentify(&app, &arguments);
  AddImport(&app, &arguments);
  AddExport(&app, &arguments);
  AddDiff(&app, &arguments, &exit_code);
  AddCut(&app, &arguments);
  AddFilter(&app, &arguments);
  AddMerge(&app, &arguments);
  AddRepair(&app, &arguments);
  AddMigrate(&app, &arguments);
  try {
    app.parse(argc, argv);
    if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0) return Trouble(app, 1);
  } catch (const CLI::ParseError& e) {
    if (e.get_exit_code() == 0) return app.exit(e);
    const auto chosen = app.get_subcommands();
    std::fprintf(stderr, "chase-log: %s; see chase-log %s--help\n", e.what(),
                 chosen.empty() ? "" : (chosen[0]->get_name() + " ").c_str());
    return Trouble(app, 1);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "chase-log: %s\n", e.what());
    return Trouble(app, dynamic_cast<const BadOption*>(&e) != nullptr ? 2 : 1);
  }
  return exit_code;
}
