#include "deploy/campaign/jobs.h"

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "deploy/campaign/process.h"
#include "deploy/campaign/progress_bar.h"
#include "deploy/campaign/text_file.h"

namespace chase::campaign {
namespace {

namespace fs = std::filesystem;

/// The processes in the air and what is left to start.
class Pool {
 public:
  Pool(const std::vector<Job>& jobs, const RunOptions& options)
      : options_(options), total_(jobs.size()) {
    for (const Job& job : jobs) {
      if (!IsDone(job)) {
        waiting_.push_back(job);
      } else {
        CountDone(job);
      }
    }
    std::reverse(waiting_.begin(), waiting_.end());
  }

  /// The job that left no result and why; empty when all is done.
  std::string Run() {
    ProgressBar bar(total_, done_, options_.quiet);
    bar.Show("", done_, failed_);
    while (!flying_.empty() || MayStart()) {
      while (MayStart()) StartNext();
      const std::string last = TakeNext();
      bar.Show(last, done_, failed_);
    }
    if (!problem_.empty()) bar.End();
    return problem_;
  }

 private:
  bool MayStart() const {
    return !waiting_.empty() && problem_.empty() &&
           static_cast<int>(flying_.size()) < options_.jobs;
  }

  void StartNext() {
    Process process(waiting_.back().command);
    const pid_t id = process.id();
    flying_.emplace(id, std::make_pair(std::move(waiting_.back()), std::move(process)));
    waiting_.pop_back();
  }

  /// Waits until one ends; what the bar says of it.
  std::string TakeNext() {
    for (;;) {
      int status = 0;
      const pid_t ended = waitpid(-1, &status, 0);
      if (ended < 0 && errno != EINTR) throw std::runtime_error("the flights' processes are lost");
      const auto at = flying_.find(ended);
      if (at == flying_.end()) continue;
      const auto [job, process] = std::move(at->second);
      flying_.erase(at);
      if (status == 0) {
        CountDone(job);
        return job.name;
      }
      if (problem_.empty()) problem_ = job.name + ": " + process.Reason(status);
      return job.name + " FAILED";
    }
  }

  void CountDone(const Job& job) {
    ++done_;
    if (options_.failed(job)) ++failed_;
  }

  const RunOptions& options_;
  size_t total_, done_ = 0, failed_ = 0;
  std::vector<Job> waiting_;
  std::map<pid_t, std::pair<Job, Process>> flying_;
  std::string problem_;
};

}  // namespace

bool IsDone(const Job& job) {
  if (!fs::is_regular_file(job.file)) return false;
  const auto json = nlohmann::json::parse(ReadText(job.file), nullptr, false);
  if (!json.is_object()) return false;
  const auto print = json.find("fingerprint");
  return print != json.end() && *print == job.fingerprint;
}

void MakeFolder(const std::string& out) {
  const fs::path folder = fs::path(out) / "flights";
  std::error_code error;
  fs::create_directories(folder, error);
  if (!fs::is_directory(folder) || access(folder.c_str(), W_OK) != 0)
    throw std::runtime_error("--out " + out +
                             ": no folder that can be written to; check the path and its rights");
}

void Run(const std::vector<Job>& jobs, const RunOptions& options) {
  const std::string problem = Pool(jobs, options).Run();
  if (!problem.empty())
    throw std::runtime_error("the flight " + problem + "; the others are kept, run again to go on");
}

}  // namespace chase::campaign
