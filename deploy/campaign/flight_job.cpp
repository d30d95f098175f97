#include "deploy/campaign/flight_job.h"

#include <fmt/format.h>
#include <sys/wait.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <stdexcept>

#include "deploy/campaign/judge.h"
#include "deploy/campaign/process.h"
#include "deploy/campaign/text_file.h"

namespace chase::campaign {
namespace {

namespace fs = std::filesystem;
using Command = std::vector<std::string>;
using Json = nlohmann::ordered_json;

constexpr char kLog[] = "flight.lcm";

std::string Number(double value) { return fmt::format("{}", value); }

Command WorldCommand(const Flight& flight, const Setup& setup, const std::string& file) {
  Command command = {(fs::path(setup.programs) / "chase-world").string(), flight.kind, "--seed",
                     std::to_string(flight.seed)};
  if (setup.duration > 0.0) command.insert(command.end(), {"--duration", Number(setup.duration)});
  command.insert(command.end(), {"--out", file});
  return command;
}

Command FlightCommand(const Flight& flight, const Setup& setup, const std::string& scenario) {
  Command command = {(fs::path(setup.programs) / "chase-flight").string(), scenario, "--seed",
                     std::to_string(flight.seed)};
  if (!flight.fault.empty()) command.insert(command.end(), {"--fault", flight.fault});
  // A random world is made as long as the flight.
  if (setup.duration > 0.0 && flight.kind.empty())
    command.insert(command.end(), {"--until", Number(setup.duration)});
  if (!setup.fly_on) command.emplace_back("--end-on-collision");
  return command;
}

/// This program with one flight.
Command OwnCommand(const Flight& flight, const Setup& setup) {
  Command command = {ThisProgram(),
                     "--fly",
                     flight.kind.empty() ? "--scenarios" : "--kinds",
                     flight.kind.empty() ? flight.file : flight.kind,
                     "--seeds",
                     std::to_string(flight.seed)};
  if (!flight.fault.empty()) command.insert(command.end(), {"--faults", flight.fault});
  if (setup.duration > 0.0) command.insert(command.end(), {"--duration", Number(setup.duration)});
  if (setup.fly_on) command.emplace_back("--fly-on");
  command.insert(command.end(), {"--programs", fs::absolute(setup.programs).string(), "--out",
                                 fs::absolute(setup.out).string()});
  return command;
}

/// Files are read once for all flights.
class Fingerprints {
 public:
  std::string Of(const Flight& flight, const Setup& setup) {
    const fs::path programs = setup.programs;
    const bool random = !flight.kind.empty();
    const std::string world = random ? Program(programs / "chase-world") : Scenario(flight.file);
    return Fingerprint({Program(programs / "chase-flight"), world, flight.Name(),
                        Number(setup.duration), setup.fly_on ? "fly on" : ""});
  }

 private:
  std::string Program(const std::string& file) {
    std::string& print = prints_[file];
    if (print.empty() && !fs::is_regular_file(file))
      throw std::runtime_error(file +
                               ": no such program; deploy/build makes it, --programs FOLDER "
                               "names another folder");
    if (print.empty()) print = Fingerprint({ReadText(file)});
    return print;
  }
  std::string Scenario(const std::string& file) {
    std::string& print = prints_[file];
    if (print.empty()) print = Fingerprint({ScenarioText(file)});
    return print;
  }

  std::map<std::string, std::string> prints_;
};

/// A folder for what a flight leaves behind, so that one that was killed leaves nothing elsewhere.
class Workplace {
 public:
  explicit Workplace(const std::string& folder) : folder_(folder) {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~Workplace() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  Workplace(const Workplace&) = delete;
  Workplace& operator=(const Workplace&) = delete;

  std::string File(const std::string& name) const { return (folder_ / name).string(); }

 private:
  fs::path folder_;
};

/// Why the program did not do its work; empty when it did. chase-flight ends with 2 when a
/// criterion failed, which the metrics tell.
std::string Problem(const Command& command) {
  const Process process(command);
  const int status = Wait(process);
  if (WIFSIGNALED(status) && (WTERMSIG(status) == SIGTERM || WTERMSIG(status) == SIGINT))
    throw std::runtime_error("was told to end; nothing is kept of it");  // from outside
  const bool fine = WIFEXITED(status) && (WEXITSTATUS(status) == 0 || WEXITSTATUS(status) == 2);
  if (fine) return "";
  return fs::path(command.front()).filename().string() + ": " + process.Reason(status);
}

/// Makes the random world in the campaign's folder; its file is whole at any time.
std::string MakeWorld(const Flight& flight, const Setup& setup, const Workplace& work,
                      std::string* problem) {
  const std::string name = flight.scenario + ".yaml";
  *problem = Problem(WorldCommand(flight, setup, work.File(name)));
  if (problem->empty() && !fs::is_regular_file(work.File(name)))
    *problem = "chase-world: wrote no world";
  const fs::path folder = fs::path(setup.out) / "worlds";
  if (!problem->empty()) return "";
  fs::create_directories(folder);
  fs::rename(work.File(name), folder / name);
  return (folder / name).string();
}

/// The metrics of a flight, or why there are none.
Json Flown(const Flight& flight, const Setup& setup, const Workplace& work) {
  std::string problem, scenario = flight.file;
  if (!flight.kind.empty()) scenario = MakeWorld(flight, setup, work, &problem);
  if (!problem.empty()) return {{"ended", problem}};
  Command command = FlightCommand(flight, setup, scenario);
  const std::string metrics = work.File("metrics.json");
  command.insert(command.end(),
                 {"--quiet", "--metrics", metrics, "--log", work.File(kLog), "--light"});
  problem = Problem(command);
  if (!problem.empty()) return {{"ended", problem}};
  if (!fs::is_regular_file(metrics)) return {{"ended", "chase-flight: wrote no metrics"}};
  const Json json = Json::parse(ReadText(metrics), nullptr, false);
  if (json.is_discarded()) return {{"ended", "chase-flight: metrics.json is no JSON"}};
  return {{"ended", ""}, {"metrics", json}};
}

/// Where the report of a flight that failed is, from the campaign's folder.
fs::path ReportFolder(const Flight& flight) { return fs::path("reports") / flight.Name(); }

/// Of a flight that failed; whole at any time. One that passes now leaves none of its last failure.
/// Without a chase-report, or where that fails, the flight is a result all the same.
void Report(const Flight& flight, const Setup& setup, const Json& result, const Workplace& work) {
  const fs::path folder = setup.out / ReportFolder(flight);
  fs::remove_all(folder);
  const std::string program = (fs::path(setup.programs) / "chase-report").string();
  const bool failed = Judge(flight, result, setup.duration)["outcome"] != outcome::kPassed;
  if (!failed || !fs::is_regular_file(program) || !fs::is_regular_file(work.File(kLog))) return;
  const std::string made = work.File("report");
  Problem({program, work.File(kLog), "--out", made});
  if (!fs::is_regular_file(fs::path(made) / "report.html")) return;
  fs::create_directories(folder.parent_path());
  fs::rename(made, folder);
}

/// As it is typed from here.
std::string Short(const fs::path& path) {
  const std::string near =
      fs::absolute(path).lexically_normal().lexically_proximate(fs::current_path());
  return near.rfind("..", 0) == 0 ? fs::absolute(path).lexically_normal().string() : near;
}

}  // namespace

std::vector<Job> Jobs(const std::vector<Flight>& flights, const Setup& setup) {
  Fingerprints prints;
  std::vector<Job> jobs;
  for (const Flight& flight : flights)
    jobs.push_back({flight.Name(), OwnCommand(flight, setup),
                    (fs::path(setup.out) / "flights" / (flight.Name() + ".json")).string(),
                    prints.Of(flight, setup)});
  return jobs;
}

void Fly(const Flight& flight, const Job& job, const Setup& setup) {
  MakeFolder(setup.out);
  if (IsDone(job)) return;
  Json result = {{"fingerprint", job.fingerprint}};
  {  // the folder is gone before the result says that the flight is done
    const Workplace work(job.file + ".work");
    setenv("TMPDIR", fs::absolute(work.File("")).c_str(), 1);
    result.update(Flown(flight, setup, work));
    Report(flight, setup, result, work);
  }
  WriteText(job.file, result.dump() + "\n");
}

std::string ReportOf(const Flight& flight, const Setup& setup) {
  const fs::path page = ReportFolder(flight) / "report.html";
  return fs::is_regular_file(setup.out / page) ? page.string() : "";
}

std::string RepeatLine(const Flight& flight, const Setup& setup) {
  Setup here = setup;
  here.programs = Short(setup.programs);
  if (flight.kind.empty()) return ShellLine(FlightCommand(flight, here, Short(flight.file)));
  const std::string file = flight.scenario + ".yaml";
  return ShellLine(WorldCommand(flight, here, file)) + " && " +
         ShellLine(FlightCommand(flight, here, file));
}

}  // namespace chase::campaign
