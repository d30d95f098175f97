#include "common/bus/heard_order.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <optional>
#include <stdexcept>
#include <tuple>

#include "chase/status_t.hpp"
#include "common/bus/bus.h"
#include "common/bus/channels.h"
#include "common/bus/message_head.h"

namespace chase::bus {
namespace {

constexpr int64_t kYear2000 = 946684800LL * 1000000;  // us; before it: logical time
constexpr double kMostSilent = 0.01;                  // share of outputs without their trigger

struct Input {
  std::string channel;
  int32_t seq;
  int64_t position;  // in the file; of a tick: -1
  int64_t utime;     // the log's stamp
  int64_t order;     // the latest stamp so far: never goes back in the file
};

/// A message that the process sent.
struct Output {
  std::string channel;
  int64_t utime;  // the log's stamp
  std::vector<MessageHead::Input> inputs;
};

struct Recorded {
  std::vector<Input> inputs;    // in the file's order
  std::vector<Output> outputs;  // the process's, in the file's order
  std::map<std::string, int64_t> lost;
  std::vector<Damage> damage;
  std::string anew;  // who was started anew: "planning", "the sender of IMU"; empty: nobody
  bool live = false, has_ticks = false;
};

Recorded Read(const std::string& log, const std::string& process,
              const std::set<std::string>& channels, const std::string& vehicle) {
  LogReader reader(log);
  Recorded recorded;
  std::map<std::string, int64_t> starts;  // by who sends
  int64_t latest = 0;
  const auto note_start = [&](const std::string& of, int64_t start) {
    if (starts.try_emplace(of, start).first->second != start && recorded.anew.empty())
      recorded.anew = of;
  };
  int64_t at = 0;
  for (LogEvent event; reader.Next(&event); at = reader.position()) {
    const auto head = HeadOf(event.bytes.data(), event.bytes.size());
    if (!head || event.channel.rfind(vehicle, 0) != 0) continue;
    const std::string channel = event.channel.substr(vehicle.size());
    latest = std::max(latest, event.utime);
    if (head->sender == process && head->vehicle == vehicle) {
      recorded.live |= event.utime >= kYear2000;
      note_start(process, head->sender_start);
      status_t status;
      if (channel != StatusChannel(process))
        recorded.outputs.push_back({channel, event.utime, head->inputs});
      else if (status.decode(event.bytes.data(), 0, static_cast<int>(event.bytes.size())) > 0)
        for (const channel_status_t& c : status.channels) recorded.lost[c.channel] = c.dropped;
    }
    if (channels.count(channel) == 0) continue;
    recorded.live |= event.utime >= kYear2000;
    note_start("the sender of " + channel, head->sender_start);
    recorded.inputs.push_back({channel, head->seq, at, event.utime, latest});
  }
  recorded.damage = reader.damage();
  return recorded;
}

/// Between two outputs the ticks are evenly spread, the last at the second one.
void AddTicks(Recorded* recorded) {
  int64_t before = 0;
  int32_t last = -1;
  for (const Output& output : recorded->outputs) {
    for (const MessageHead::Input& input : output.inputs) {
      if (input.channel != Bus::kTick) continue;
      if (!recorded->has_ticks) {
        last = input.seq - 1;
        before = output.utime;
      }
      recorded->has_ticks = true;
      const int32_t n = input.seq - last;
      for (int32_t i = 1; i <= n; ++i) {
        const int64_t utime = before + (output.utime - before) * i / n;
        recorded->inputs.push_back({Bus::kTick, last + i, -1, utime, utime});
      }
      last = std::max(last, input.seq);
    }
    before = output.utime;
  }
}

/// Of each channel the inputs in the order of their `seq`.
using Queues = std::map<std::string, std::vector<const Input*>>;

Queues QueuesOf(const std::vector<Input>& inputs) {
  Queues queues;
  for (const Input& input : inputs) queues[input.channel].push_back(&input);
  for (auto& [channel, queue] : queues)
    std::stable_sort(queue.begin(), queue.end(),
                     [](const Input* a, const Input* b) { return a->seq < b->seq; });
  return queues;
}

void SortByTime(std::vector<const Input*>* inputs) {
  std::sort(inputs->begin(), inputs->end(), [](const Input* a, const Input* b) {
    return std::tie(a->order, a->position, a->seq) < std::tie(b->order, b->position, b->seq);
  });
}

/// What was heard between one output and the next, in the file's order.
std::vector<std::vector<const Input*>> Intervals(const Recorded& recorded, const Queues& queues) {
  std::vector<std::vector<const Input*>> intervals;
  std::map<std::string, size_t> next;
  for (const Output& output : recorded.outputs) {
    auto& interval = intervals.emplace_back();
    for (const MessageHead::Input& heard : output.inputs) {
      const auto queue = queues.find(heard.channel);
      if (queue == queues.end()) continue;
      size_t& i = next[heard.channel];
      for (; i < queue->second.size() && queue->second[i]->seq <= heard.seq; ++i)
        interval.push_back(queue->second[i]);
    }
    SortByTime(&interval);
  }
  auto& rest = intervals.emplace_back();
  for (const auto& [channel, queue] : queues)
    rest.insert(rest.end(), queue.begin() + static_cast<long>(next[channel]), queue.end());
  SortByTime(&rest);
  return intervals;
}

/// By channel of outputs the channel of inputs that they answer; where there is none: not named. It
/// is heard before each of them and, being what each waits for, the latest on average.
std::map<std::string, std::string> Triggers(
    const std::vector<Output>& outputs, const std::vector<std::vector<const Input*>>& intervals) {
  struct Count {
    int64_t outputs = 0;
    double lag = 0.0;  // us, summed
  };
  std::map<std::string, std::map<std::string, Count>> counts;
  std::map<std::string, int64_t> totals;
  for (size_t k = 0; k < outputs.size(); ++k) {
    if (intervals[k].empty()) continue;  // a second answer to the same message
    ++totals[outputs[k].channel];
    std::map<std::string, int64_t> newest;
    for (const Input* input : intervals[k]) newest[input->channel] = input->utime;
    for (const auto& [channel, utime] : newest) {
      Count& count = counts[outputs[k].channel][channel];
      ++count.outputs;
      count.lag += static_cast<double>(outputs[k].utime - utime);
    }
  }
  std::map<std::string, std::string> triggers;
  for (const auto& [output, by_input] : counts) {
    const double least = (1.0 - kMostSilent) * static_cast<double>(totals[output]);
    double shortest = std::numeric_limits<double>::infinity();
    for (const auto& [input, count] : by_input) {
      const double lag = count.lag / static_cast<double>(count.outputs);
      if (static_cast<double>(count.outputs) < least || lag >= shortest) continue;
      shortest = lag;
      triggers[output] = input;
    }
  }
  return triggers;
}

/// Of channels that the log lacks altogether, too: what was heard of them since the first output.
void NoteMissing(const Recorded& recorded, const std::set<std::string>& channels,
                 const Queues& queues, HeardOrder* order) {
  for (const auto& [channel, lost] : recorded.lost)
    if (lost > 0 && queues.count(channel) > 0) order->missing[channel].lost = lost;
  std::map<std::string, int32_t> before;  // the highest `seq` that was asked for
  std::map<std::string, size_t> next;
  std::map<std::string, HeardOrder::Missing> found;
  const std::vector<const Input*> nothing;
  for (const Output& output : recorded.outputs) {
    for (const MessageHead::Input& heard : output.inputs) {
      if (channels.count(heard.channel) == 0) continue;
      const auto found_queue = queues.find(heard.channel);
      const auto& queue = found_queue == queues.end() ? nothing : found_queue->second;
      const int32_t first = queue.empty() ? heard.seq : std::min(heard.seq, queue.front()->seq);
      int32_t& last = before.try_emplace(heard.channel, first - 1).first->second;
      HeardOrder::Missing& m = found[heard.channel];
      size_t& i = next[heard.channel];
      int64_t here = 0;
      for (; i < queue.size() && queue[i]->seq <= heard.seq; ++i) ++here;
      const int64_t asked = std::max(0, heard.seq - last);
      m.of += asked;
      if (asked > here && m.count == 0) m.first_utime = output.utime;
      m.count += std::max<int64_t>(0, asked - here);
      last = std::max(last, heard.seq);
    }
  }
  for (const auto& [channel, m] : found) {
    if (m.count == 0) continue;
    const int64_t lost = order->missing[channel].lost;
    order->missing[channel] = {m.count, m.of, m.first_utime, lost};
  }
}

/// Empty where the outputs tell in which order the inputs were heard.
std::string WhyInFileOrder(const Recorded& recorded, const std::string& process) {
  if (recorded.anew.empty() && !recorded.outputs.empty()) return "";
  return fmt::format(
      "{}, so that the log does not tell in which order {} heard its inputs; they "
      "are replayed in the order in which they were recorded",
      recorded.anew.empty() ? "the log holds nothing that " + process + " sent"
                            : recorded.anew + " was started anew in this log",
      process);
}

}  // namespace

std::vector<std::string> HeardOrder::Sentences() const {
  std::vector<std::string> lines;
  if (!in_file_order.empty())
    lines.push_back(in_file_order + "; the replay's answers may differ from the flight's");
  for (const auto& [channel, m] : missing) {
    if (m.count > 0)
      lines.push_back(fmt::format(
          "{}: {} of {} messages that it heard are not in the log; from {:.3f} s on its answers "
          "may differ",
          channel, m.count, m.of, 1e-6 * static_cast<double>(m.first_utime)));
    if (m.lost > 0)
      lines.push_back(fmt::format(
          "{}: in the flight it lost {} messages; the replay hears those that the log holds",
          channel, m.lost));
  }
  for (const Damage& d : damage) lines.push_back(Format(d));
  return lines;
}

HeardOrder OrderHeard(const std::string& log, const std::string& process,
                      const std::set<std::string>& channels, const std::string& vehicle) {
  Recorded recorded = Read(log, process, channels, vehicle);
  AddTicks(&recorded);
  const Queues queues = QueuesOf(recorded.inputs);
  HeardOrder order;
  order.damage = recorded.damage;
  if (const std::string why = WhyInFileOrder(recorded, process); !why.empty()) {
    if (recorded.live) order.in_file_order = why;
    return order;
  }
  NoteMissing(recorded, channels, queues, &order);
  if (!recorded.live) return order;
  order.has_ticks = recorded.has_ticks;
  auto intervals = Intervals(recorded, queues);
  const auto triggers = Triggers(recorded.outputs, intervals);
  for (size_t k = 0; k < intervals.size(); ++k) {
    auto& interval = intervals[k];
    const auto trigger =
        k < recorded.outputs.size() ? triggers.find(recorded.outputs[k].channel) : triggers.end();
    if (trigger != triggers.end()) {
      const auto last = std::find_if(interval.rbegin(), interval.rend(), [&](const Input* input) {
        return input->channel == trigger->second;
      });
      if (last != interval.rend()) std::rotate(last.base() - 1, last.base(), interval.end());
    }
    for (const Input* input : interval) order.events.push_back({input->position, input->utime});
  }
  return order;
}

}  // namespace chase::bus
