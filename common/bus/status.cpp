#include "common/bus/status.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <climits>
#include <fstream>

#include "common/config/checksum.h"
#include "common/config/version.h"

namespace chase::bus {

namespace {

double Seconds(const timeval& t) {
  return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
}

/// Of this process now, MiB: proc(5), statm; ru_maxrss is the peak.
double ResidentMb() {
  long total = 0, resident = 0;  // pages
  std::ifstream("/proc/self/statm") >> total >> resident;
  return static_cast<double>(resident) * static_cast<double>(sysconf(_SC_PAGESIZE)) / 1048576.0;
}

void AddUsage(status_t* status) {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  status->cpu = Seconds(usage.ru_utime) + Seconds(usage.ru_stime);
  status->rss_mb = ResidentMb();
}

void AddStages(const StageClock& clock, status_t* status) {
  for (const auto& [name, s] : clock.Summaries()) {
    stage_status_t stage{};
    stage.name = name;
    stage.count = s.count;
    stage.mean_ms = s.mean_ms;
    stage.p50_ms = s.p50_ms;
    stage.p99_ms = s.p99_ms;
    stage.max_ms = s.max_ms;
    status->stages.push_back(stage);
  }
  status->n_stages = static_cast<int32_t>(status->stages.size());
}

/// Takes off `text` what follows `key`, its last; empty where it is not there.
std::string CutBehind(const std::string& key, std::string* text) {
  const size_t at = text->rfind(key);
  if (at == std::string::npos) return "";
  const std::string value = text->substr(at + key.size());
  text->resize(at);
  return value;
}

int8_t StateCode(NodeReport::State state) {
  switch (state) {
    case NodeReport::State::kStarting:
      return status_t::STARTING;
    case NodeReport::State::kOk:
      return status_t::OK;
    case NodeReport::State::kDegraded:
      return status_t::DEGRADED;
    case NodeReport::State::kFailed:
      break;
  }
  return status_t::FAILED;
}

}  // namespace

std::string ConfiguredVersion(const std::string& configuration) {
  return fmt::format("{}, configuration {}", config::Version(), config::Checksum(configuration));
}

std::string LiveVersion(const std::string& configuration) {
  char host[HOST_NAME_MAX + 1] = "";
  if (gethostname(host, sizeof host - 1) != 0) host[0] = '\0';
  return fmt::format("{}, host {}, configuration {}", config::Version(),
                     host[0] != '\0' ? host : "unknown", config::Checksum(configuration));
}

Software SoftwareOf(const std::string& version) {
  Software software{version, "", ""};
  software.configuration = CutBehind(", configuration ", &software.version);
  software.host = CutBehind(", host ", &software.version);
  return software;
}

StatusReporter::StatusReporter(std::string name, std::string version)
    : name_(std::move(name)), version_(version.empty() ? config::Version() : std::move(version)) {}

status_t StatusReporter::Make(const Bus& bus, const Node& node, int64_t utime, bool measured) {
  if (start_ < 0) start_ = utime;
  const NodeReport report = node.Report();
  status_t status{};
  status.utime = utime;
  status.name = name_;
  status.state = StateCode(report.state);
  status.detail = report.detail;
  status.last_error = bus.last_error();
  status.version = version_;
  status.uptime = static_cast<double>(utime - start_) * 1e-6;
  const double elapsed = last_ < 0 ? 0.0 : static_cast<double>(utime - last_) * 1e-6;
  for (const auto& [name, c] : bus.counters()) {
    channel_status_t channel{};
    channel.channel = name;
    channel.received = c.received;
    channel.dropped = c.dropped;
    channel.foreign = c.foreign;
    channel.malformed = c.malformed;
    int64_t& last = last_received_[name];
    channel.rate_hz = elapsed > 0.0 ? static_cast<double>(c.received - last) / elapsed : 0.0;
    last = c.received;
    status.channels.push_back(channel);
  }
  status.n_channels = static_cast<int32_t>(status.channels.size());
  last_ = utime;
  if (measured) {
    AddUsage(&status);
    AddStages(bus.stages(), &status);
  }
  return status;
}

}  // namespace chase::bus
