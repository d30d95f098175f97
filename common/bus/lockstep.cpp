#include "common/bus/lockstep.h"

#include <ctime>
#include <stdexcept>

#include "common/bus/channels.h"

namespace chase::bus {

namespace {

constexpr int64_t kStatusPeriod = 1000000;  // us

double ThreadCpu() {
  timespec t{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace

/// One process's view of the lockstep.
class Lockstep::Port : public Bus {
 public:
  Port(Lockstep* lockstep, int64_t latency) : lockstep_(lockstep), latency_(latency) {}
  int64_t Now() const override { return lockstep_->now_; }
  const RawHandler* Handler(const std::string& channel) const {
    const auto it = handlers_.find(channel);
    return it == handlers_.end() ? nullptr : &it->second;
  }

 protected:
  void SubscribeRaw(const std::string& channel, RawHandler handler) override {
    handlers_[channel] = std::move(handler);
  }
  void PublishRaw(const std::string& channel, const Bytes& bytes) override {
    lockstep_->Send(lockstep_->now_ + latency_, channel, bytes);
  }

 private:
  Lockstep* lockstep_;
  int64_t latency_;
  std::map<std::string, RawHandler> handlers_;
};

struct Lockstep::Process {
  Process(Lockstep* lockstep, std::string process_name, int64_t latency)
      : name(std::move(process_name)), port(lockstep, latency), reporter(name) {}
  std::string name;
  Port port;
  StatusReporter reporter;
  std::unique_ptr<Node> node;
  double cpu_s = 0.0;

  template <class F>
  void Run(const F& work) {
    const double start = ThreadCpu();
    work();
    cpu_s += ThreadCpu() - start;
  }
};

void Lockstep::Add(const std::string& name, int64_t latency_us, const MakeNode& make) {
  auto process = std::make_shared<Process>(this, name, latency_us);
  process->node = make(process->port);
  processes_.push_back(process);
  if (process->node->TickPeriod() > 0) ScheduleTick(process.get(), now_);
  ScheduleStatus(process.get(), now_ + kStatusPeriod);
}

void Lockstep::Send(int64_t utime, const std::string& channel, const Bus::Bytes& bytes) {
  events_.push({utime, order_++, channel, std::make_shared<const Bus::Bytes>(bytes), nullptr});
}

void Lockstep::Call(int64_t utime, std::function<void()> call) {
  events_.push({utime, order_++, "", nullptr, std::move(call)});
}

void Lockstep::ScheduleTick(Process* process, int64_t utime) {
  Call(utime, [this, process, utime] {
    process->Run([&] { process->node->Tick(utime); });
    ScheduleTick(process, utime + process->node->TickPeriod());
  });
}

void Lockstep::ScheduleStatus(Process* process, int64_t utime) {
  Call(utime, [this, process, utime] {
    process->port.Publish(StatusChannel(process->name),
                          process->reporter.Make(process->port, *process->node, utime, false));
    ScheduleStatus(process, utime + kStatusPeriod);
  });
}

void Lockstep::Deliver(const Event& event) {
  if (event.call) return event.call();
  if (tap_) tap_(event.utime, event.channel, *event.bytes);
  for (const auto& process : processes_)
    if (const auto* handler = process->port.Handler(event.channel))
      process->Run([&] { (*handler)(event.bytes->data(), event.bytes->size()); });
}

void Lockstep::RunUntil(int64_t utime) {
  while (!events_.empty() && events_.top().utime <= utime) {
    const Event event = events_.top();
    events_.pop();
    now_ = event.utime;
    Deliver(event);
  }
  now_ = utime;
}

bool Lockstep::Done() const {
  for (const auto& process : processes_)
    if (process->node->Done()) return true;
  return false;
}

std::map<std::string, Lockstep::Usage> Lockstep::Usages() const {
  std::map<std::string, Usage> usages;
  for (const auto& process : processes_)
    usages[process->name] = {process->cpu_s, process->port.stages().Summaries()};
  return usages;
}

const Bus& Lockstep::bus(const std::string& name) const {
  for (const auto& process : processes_)
    if (process->name == name) return process->port;
  throw std::runtime_error("no process " + name + " in this lockstep");
}

}  // namespace chase::bus
