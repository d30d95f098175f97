#include "common/bus/lockstep.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <deque>
#include <stdexcept>
#include <utility>

#include "common/bus/channels.h"
#include "common/bus/live_loop.h"

namespace chase::bus {

namespace {

constexpr int64_t kStatusPeriod = 1000000;  // us

double Seconds(clockid_t clock) {
  timespec t{};
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace

/// One process's view of the lockstep.
class Lockstep::Port : public Bus {
 public:
  Port(Lockstep* lockstep, const std::string& process, int64_t latency)
      : lockstep_(lockstep), latency_(latency) {
    SetIdentity({process, "", lockstep->now_});
  }
  int64_t Now() const override { return lockstep_->now_; }
  const RawHandler* Handler(const std::string& channel) const {
    const auto it = handlers_.find(channel);
    return it == handlers_.end() ? nullptr : &it->second;
  }

 protected:
  void SubscribeRaw(const std::string& channel, RawHandler handler) override {
    handlers_[channel] = std::move(handler);
  }
  void PublishRaw(const std::string& channel, Bytes bytes) override {
    const int64_t late = std::llround(lockstep_->load_ * static_cast<double>(latency_));
    due_ = std::max(due_, lockstep_->now_ + late);  // nothing overtakes when a load ends
    lockstep_->Send(due_, channel, std::move(bytes));
  }

 private:
  Lockstep* lockstep_;
  int64_t latency_, due_ = 0;
  std::map<std::string, RawHandler> handlers_;
};

/// A process from its start to its end.
struct Lockstep::Life {
  Life(Lockstep* lockstep, const Process& process);
  Port port;
  StatusReporter reporter;
  std::unique_ptr<Node> node;
  TickClock ticks;
  int64_t next_status;
};

struct Lockstep::Process {
  std::string name, version;
  int64_t latency;
  MakeNode make;
  std::unique_ptr<Life> life;       // none: dead
  int stops = 0;                    // kills and freezes; what was scheduled before one is void
  bool frozen = false;              // and then:
  std::deque<Event> inbox;          // what came
  int64_t buffer = 0;               // bytes that still find place in the socket
  std::map<std::string, int> room;  // messages that each channel still has place for
  double wall_s = 0.0;

  void Stop(bool freeze) {
    ++stops;
    frozen = freeze;
    inbox.clear();
    buffer = kReceiveBuffer;
    room.clear();
  }
  void Keep(const Event& event) {
    // A part of what does not fit fills it.
    buffer -= static_cast<int64_t>(event.bytes->size()) + kPerMessage;
    if (buffer < 0 || life->port.Handler(event.channel) == nullptr) return;
    if (room.emplace(event.channel, QueueCapacity(event.channel)).first->second-- > 0)
      inbox.push_back(event);
  }
  template <class F>
  void Run(const F& work) {
    const double start = Seconds(CLOCK_MONOTONIC);
    work();
    wall_s += Seconds(CLOCK_MONOTONIC) - start;
  }
};

Lockstep::Life::Life(Lockstep* lockstep, const Process& process)
    : port(lockstep, process.name, process.latency),
      reporter(process.name, process.version),
      node(process.make(port)),
      ticks(node->TickPeriod(), lockstep->now_),
      next_status(lockstep->now_ + kStatusPeriod) {}

void Lockstep::Add(const std::string& name, int64_t latency_us, const MakeNode& make,
                   const std::string& configuration) {
  auto process = std::make_shared<Process>();
  process->name = name;
  if (!configuration.empty()) process->version = ConfiguredVersion(configuration);
  process->latency = latency_us;
  process->make = make;
  Begin(process.get());
  processes_.push_back(process);
}

void Lockstep::Begin(Process* process) {
  process->life = std::make_unique<Life>(this, *process);
  if (process->life->node->TickPeriod() > 0) Schedule(process, now_, &Lockstep::Tick);
  Schedule(process, process->life->next_status, &Lockstep::Status);
}

void Lockstep::Kill(const std::string& name) {
  Process& process = Find(name);
  process.Stop(false);
  process.life.reset();
}

void Lockstep::Start(const std::string& name) {
  Process& process = Find(name);
  if (!process.life) Begin(&process);
}

void Lockstep::Freeze(const std::string& name) {
  Process& process = Find(name);
  if (process.life && !process.frozen) process.Stop(true);
}

void Lockstep::Thaw(const std::string& name) {
  Process& process = Find(name);
  if (!process.frozen) return;
  process.frozen = false;
  CatchUp(&process);
  const Life& life = *process.life;
  if (life.node->TickPeriod() > 0) Schedule(&process, life.ticks.next(), &Lockstep::Tick);
  Schedule(&process, std::max(life.next_status, now_), &Lockstep::Status);
}

/// What the live loop does when it runs again.
void Lockstep::CatchUp(Process* process) {
  const Life& life = *process->life;
  auto& inbox = process->inbox;
  while (life.ticks.Due(now_) || !inbox.empty()) {
    if (life.ticks.Due(now_)) TickOnce(process);
    for (int i = 0; i < kBurst && !inbox.empty(); ++i) {
      Handle(process, inbox.front());
      inbox.pop_front();
    }
  }
}

void Lockstep::SetLoss(double share, uint64_t seed) {
  loss_ = share;
  loss_draws_ = world::Random{seed};
}

std::unique_ptr<Bus> Lockstep::Connect() { return std::make_unique<Port>(this, "", 0); }

void Lockstep::Send(int64_t utime, const std::string& channel, Bus::Bytes bytes) {
  if (const auto delay = delays_.find(channel); delay != delays_.end()) utime += delay->second;
  events_.push(
      {utime, order_++, channel, std::make_shared<const Bus::Bytes>(std::move(bytes)), nullptr});
}

void Lockstep::Call(int64_t utime, std::function<void()> call) {
  events_.push({utime, order_++, "", nullptr, std::move(call)});
}

void Lockstep::Schedule(Process* process, int64_t utime, void (Lockstep::*work)(Process*)) {
  Call(utime, [this, process, work, stops = process->stops] {
    if (stops == process->stops) (this->*work)(process);
  });
}

void Lockstep::TickOnce(Process* process) {
  Life& life = *process->life;
  process->Run([&] { life.node->Tick(life.ticks.Take(now_)); });
}

void Lockstep::Tick(Process* process) {
  TickOnce(process);
  Schedule(process, process->life->ticks.next(), &Lockstep::Tick);
}

void Lockstep::Status(Process* process) {
  Life& life = *process->life;
  life.port.Publish(StatusChannel(process->name),
                    life.reporter.Make(life.port, *life.node, now_, false));
  life.next_status = now_ + kStatusPeriod;
  Schedule(process, life.next_status, &Lockstep::Status);
}

void Lockstep::Handle(Process* process, const Event& event) {
  if (const auto* handler = process->life->port.Handler(event.channel))
    process->Run([&] { (*handler)(event.bytes->data(), event.bytes->size()); });
}

void Lockstep::Deliver(const Event& event) {
  if (event.call) return event.call();
  if (tap_) tap_(event.utime, event.channel, *event.bytes);
  for (const auto& process : processes_)
    if (loss_ > 0.0 && loss_draws_.Uniform() < loss_)
      continue;
    else if (process->frozen)
      process->Keep(event);
    else if (process->life)
      Handle(process.get(), event);
}

void Lockstep::RunUntil(int64_t utime) {
  const double wall = Seconds(CLOCK_MONOTONIC), cpu = Seconds(CLOCK_THREAD_CPUTIME_ID);
  while (!events_.empty() && events_.top().utime <= utime) {
    const Event event = events_.top();
    events_.pop();
    now_ = event.utime;
    Deliver(event);
  }
  now_ = utime;
  wall_s_ += Seconds(CLOCK_MONOTONIC) - wall;
  cpu_s_ += Seconds(CLOCK_THREAD_CPUTIME_ID) - cpu;
}

bool Lockstep::Done() const {
  for (const auto& process : processes_)
    if (process->life && process->life->node->Done()) return true;
  return false;
}

/// Processor time by shares of wall time: the processor's own clock is a system call, some
/// thousands of them in a simulated second.
std::map<std::string, Lockstep::Usage> Lockstep::Usages() const {
  const double share = wall_s_ > 0.0 ? cpu_s_ / wall_s_ : 0.0;
  std::map<std::string, Usage> usages;
  for (const auto& process : processes_) {
    usages[process->name].cpu_s = share * process->wall_s;
    if (process->life) usages[process->name].stages = process->life->port.stages().Summaries();
  }
  return usages;
}

const Bus& Lockstep::bus(const std::string& name) const {
  const Process& process = Find(name);
  if (!process.life) throw std::runtime_error("process " + name + " of this lockstep is dead");
  return process.life->port;
}

Lockstep::Process& Lockstep::Find(const std::string& name) const {
  for (const auto& process : processes_)
    if (process->name == name) return *process;
  throw std::runtime_error("no process " + name + " in this lockstep");
}

}  // namespace chase::bus
