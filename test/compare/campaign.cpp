#include "test/compare/campaign.h"

#include <fmt/format.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <stdexcept>
#include <utility>

#include "common/world/scenario.h"
#include "test/baselines/registry.h"
#include "test/compare/flight_file.h"

namespace chase::compare {
namespace {

namespace fs = std::filesystem;

std::string Program() { return fs::read_symlink("/proc/self/exe").string(); }

uint64_t Hash(const std::string& text, uint64_t hash = 0xcbf29ce484222325ull) {
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ull;
  return hash;
}

/// Of the program, the scenario and the target's path: equal prints, equal flights.
std::string Fingerprint(const std::string& scenario) {
  static const uint64_t program = Hash(ReadText(Program()));
  const std::string file = ScenarioFile(scenario);
  uint64_t hash = Hash(ReadText(file), program);
  const std::string path = world::LoadScenario(file).target.path_file;
  if (!path.empty()) hash = Hash(ReadText(path), hash);
  return fmt::format("{:016x}", hash);
}

std::string NameOf(const std::string& scenario) { return fs::path(ScenarioFile(scenario)).stem(); }

bool IsDone(const Job& job) {
  if (!fs::is_regular_file(job.file)) return false;
  const auto j = nlohmann::json::parse(ReadText(job.file), nullptr, false);
  return j.is_object() && j.value("fingerprint", "") == Fingerprint(job.scenario);
}

std::string Quoted(const std::string& text) {
  if (text.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                             "_-./:,=+") == std::string::npos)
    return text;
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

class Progress {
 public:
  Progress(size_t total, bool quiet) : total_(total), quiet_(quiet) { Show("", 0); }

  void Show(const std::string& last, size_t done) {
    if (quiet_) return;
    constexpr size_t kWidth = 30;
    const size_t filled = total_ > 0 ? kWidth * done / total_ : kWidth;
    const double spent =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
    const std::string left =
        done > 0 ? fmt::format("{:.0f} s left", spent / static_cast<double>(done) *
                                                    static_cast<double>(total_ - done))
                 : "";
    fmt::print(stderr, "\r[{:#<{}}{:.<{}}] {}/{} {:<12} {:<28}", "", filled, "", kWidth - filled,
               done, total_, left, last);
    if (done == total_) End();
    std::fflush(stderr);
  }

  void End() {
    if (!quiet_) fmt::print(stderr, "\n");
  }

 private:
  size_t total_;
  bool quiet_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

/// A file without a name for what a flight's process says on stderr, so that it does not run into
/// the bar.
struct Close {
  void operator()(std::FILE* file) const { std::fclose(file); }
};
using Words = std::unique_ptr<std::FILE, Close>;

/// The last line of what was said, without the program's name.
std::string LastLine(std::FILE* words) {
  std::rewind(words);
  std::string text;
  for (int c = 0; (c = std::fgetc(words)) != EOF;) text += static_cast<char>(c);
  text.erase(text.find_last_not_of(" \n") + 1);
  text.erase(0, text.rfind('\n') + 1);
  const std::string name = "chase-compare: ";
  return text.rfind(name, 0) == 0 ? text.substr(name.size()) : text;
}

std::string Ending(int status) {
  return WIFSIGNALED(status) ? fmt::format("ended by signal {}", WTERMSIG(status))
                             : fmt::format("exit code {}", WEXITSTATUS(status));
}

pid_t Start(const Job& job, std::FILE* said) {
  const std::string program = Program();
  std::vector<std::string> words = {program,     "--fly",    job.scenario, "--planners",
                                    job.planner, "--result", job.file};
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const pid_t child = fork();
  if (child < 0) throw std::runtime_error("a process for the flight cannot be started");
  if (child > 0) return child;
  dup2(fileno(said), STDERR_FILENO);
  execv(program.c_str(), argv.data());
  _exit(127);
}

}  // namespace

std::vector<Job> Jobs(const Arguments& arguments) {
  std::vector<std::string> scenarios = arguments.scenarios, planners;
  if (scenarios.empty())
    for (int i = 1; i <= 12; ++i) scenarios.push_back("S" + std::to_string(i));
  for (const std::string& given : arguments.planners)
    for (const std::string& name : baselines::Expand(given)) planners.push_back(name);
  if (arguments.planners.empty())
    for (const auto& entry : baselines::Planners())
      if (entry.by_default) planners.push_back(entry.name);
  std::vector<Job> jobs;
  std::map<std::string, std::string> files;
  for (const std::string& scenario : scenarios) {
    if (!fs::is_regular_file(ScenarioFile(scenario)))
      throw std::runtime_error(
          "no scenario '" + scenario +
          "'; use S1 to S12 or the path of a scenario file whose obstacles are "
          "upright ellipsoids");
    LoadMission(scenario);  // what cannot be flown is said before the first flight
    const std::string name = NameOf(scenario);
    if (const auto [at, fresh] = files.emplace(name, scenario); !fresh)
      throw std::runtime_error(scenario + ": has the same name as " + at->second +
                               "; results would overwrite each other");
    for (std::string planner : planners) {
      Job job{scenario, planner, ""};
      std::replace(planner.begin(), planner.end(), ':', '-');
      job.file = (fs::path(arguments.out) / "flights" / (name + "_" + planner + ".json")).string();
      if (std::none_of(jobs.begin(), jobs.end(),
                       [&](const Job& other) { return other.file == job.file; }))
        jobs.push_back(job);
    }
  }
  return jobs;
}

std::string Command(const Job& job, const Arguments& /*arguments*/) {
  return fmt::format("{} --fly {} --planners {} --result {}", Quoted(Program()),
                     Quoted(job.scenario), Quoted(job.planner), Quoted(job.file));
}

void FlyJob(const Job& job) {
  const Mission mission = LoadMission(job.scenario);
  const auto planner =
      baselines::MakePlanner(job.planner, {mission.planning.planner, mission.name, 0});
  const Rollout rollout = Fly(mission, planner.get());
  auto json = FlightJson(mission, job.planner, rollout, Judge(mission, rollout));
  json["fingerprint"] = Fingerprint(job.scenario);
  if (const fs::path folder = fs::path(job.file).parent_path(); !folder.empty())
    fs::create_directories(folder);
  WriteText(job.file, json.dump() + "\n");
}

void Run(const std::vector<Job>& jobs, const Arguments& arguments) {
  std::vector<Job> waiting;
  for (const Job& job : jobs)
    if (!IsDone(job)) waiting.push_back(job);
  const fs::path folder = fs::path(arguments.out) / "flights";
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder) || access(folder.c_str(), W_OK) != 0)
    throw std::runtime_error("--out " + arguments.out +
                             ": no folder that can be written to; check the path and its rights");
  size_t done = jobs.size() - waiting.size();
  Progress progress(jobs.size(), arguments.quiet);
  progress.Show("", done);
  std::reverse(waiting.begin(), waiting.end());
  std::map<pid_t, std::pair<Job, Words>> flying;
  std::string failed;
  while ((!waiting.empty() && failed.empty()) || !flying.empty()) {
    while (!waiting.empty() && failed.empty() && static_cast<int>(flying.size()) < arguments.jobs) {
      Words said(std::tmpfile());
      if (!said) throw std::runtime_error("no file for a flight's messages; is the disk full?");
      const pid_t child = Start(waiting.back(), said.get());
      flying[child] = {waiting.back(), std::move(said)};
      waiting.pop_back();
    }
    int status = 0;
    const pid_t ended = waitpid(-1, &status, 0);
    const auto at = flying.find(ended);
    if (at == flying.end()) continue;
    const auto& [job, said] = at->second;
    const std::string what = NameOf(job.scenario) + " " + job.planner;
    if (status != 0 && failed.empty()) {
      const std::string reason = LastLine(said.get());
      failed = what + ": " + (reason.empty() ? Ending(status) : reason);
    }
    flying.erase(at);
    if (status == 0) ++done;
    progress.Show(what + (status == 0 ? "" : " FAILED"), done);
  }
  if (!failed.empty()) {
    progress.End();
    throw std::runtime_error("the flight " + failed + "; the others are kept, run again to go on");
  }
}

}  // namespace chase::compare
