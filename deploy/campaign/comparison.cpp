#include "deploy/campaign/comparison.h"

#include <fmt/format.h>

#include <filesystem>
#include <map>
#include <stdexcept>
#include <tuple>

#include "deploy/campaign/judge.h"
#include "deploy/campaign/statistics.h"
#include "deploy/campaign/table.h"
#include "deploy/campaign/text_file.h"

namespace chase::campaign {
namespace {

using Json = nlohmann::ordered_json;

constexpr double kLevel = 0.05;

/// One figure or count of one row, tested.
struct Line {
  std::string row, what, text;
  bool better = false;  ///< which way it went; with worse: neither when nothing changed
  bool worse = false;
  TestResult test;
};

/// What is counted, and whether more of it is better.
struct Event {
  const char* name;
  const char* outcome;
  bool good;
};
constexpr Event kEvents[] = {{"passed", outcome::kPassed, true},
                             {"collisions", outcome::kCollision, false}};
struct Ratio {
  const char* key;
  bool more_is_better;
};
constexpr Ratio kRatios[] = {
    {"visible_ratio", true}, {"distance_error", false}, {"odometry_ate_m", false}};

using Key = std::tuple<std::string, std::string, std::string, int64_t>;

Key KeyOf(const Json& f) {
  return {f.value("kind", std::string()), f["scenario"], f["fault"], f["seed"].get<int64_t>()};
}

/// The flights of a row before and now; when paired, the same flight at the same place.
struct Sides {
  Row before, now;
  bool paired = false;
};

Sides SidesOf(const Row& before, const Row& now) {
  std::map<Key, const Json*> old;
  for (const Json* f : before.flights) old[KeyOf(*f)] = f;
  Sides pairs{{now.place, now.fault, {}}, {now.place, now.fault, {}}, true};
  for (const Json* f : now.flights) {
    const auto at = old.find(KeyOf(*f));
    if (at == old.end()) continue;
    pairs.before.flights.push_back(at->second);
    pairs.now.flights.push_back(f);
  }
  return pairs.now.flights.empty() ? Sides{before, now, false} : pairs;
}

bool Is(const Json* flight, const Event& event) { return (*flight)["outcome"] == event.outcome; }

long Count(const Row& row, const Event& event) {
  long n = 0;
  for (const Json* f : row.flights) n += Is(f, event);
  return n;
}

std::string Share(long k, size_t n) {
  const Interval share = Wilson(k, static_cast<long>(n));
  return fmt::format("{} of {} ({:.2f} to {:.2f})", k, n, share.low, share.high);
}

Line Counted(const Sides& sides, const Event& event) {
  const size_t n_before = sides.before.flights.size(), n_now = sides.now.flights.size();
  const long before = Count(sides.before, event), now = Count(sides.now, event);
  Line line{sides.now.Title(),
            event.name,
            Share(before, n_before) + " -> " + Share(now, n_now),
            false,
            false,
            {}};
  long more = 0, less = 0;
  if (sides.paired) {
    for (size_t i = 0; i < n_now; ++i) {
      const bool was = Is(sides.before.flights[i], event), is = Is(sides.now.flights[i], event);
      more += is && !was;
      less += was && !is;
    }
    line.test = McNemar(more, less);
    line.text +=
        fmt::format(", {} better, {} worse", event.good ? more : less, event.good ? less : more);
  } else {
    line.test = Fisher(before, static_cast<long>(n_before), now, static_cast<long>(n_now));
    more = now * static_cast<long>(n_before), less = before * static_cast<long>(n_now);
  }
  line.better = event.good ? more > less : less > more;
  line.worse = event.good ? less > more : more > less;
  return line;
}

bool Number(const Json& flight, const char* key, double* value) {
  const auto at = flight.find(key);
  if (at == flight.end() || !at->is_number()) return false;
  *value = *at;
  return true;
}

std::vector<double> Differences(const Sides& sides, const char* key) {
  std::vector<double> differences;
  for (size_t i = 0; i < sides.now.flights.size(); ++i) {
    double before = 0.0, now = 0.0;
    if (Number(*sides.before.flights[i], key, &before) && Number(*sides.now.flights[i], key, &now))
      differences.push_back(now - before);
  }
  return differences;
}

Line Measured(const Sides& sides, const Ratio& ratio) {
  Line line{sides.now.Title(), ratio.key, "", false, false, {}};
  Mean change;
  if (sides.paired) {
    const auto differences = Differences(sides, ratio.key);
    line.test = SignFlip(differences);
    change = MeanOf(differences);
  } else {
    const auto before = Values(sides.before, ratio.key), now = Values(sides.now, ratio.key);
    line.test = Welch(before, now);
    change = DifferenceOf(before, now);
  }
  line.text = fmt::format("{:+.4g}", change.mean);
  if (change.interval)
    line.text += fmt::format(" ({:+.4g} to {:+.4g})", change.interval->low, change.interval->high);
  line.better = ratio.more_is_better ? change.mean > 0.0 : change.mean < 0.0;
  line.worse = ratio.more_is_better ? change.mean < 0.0 : change.mean > 0.0;
  return line;
}

void AddLines(const Sides& sides, std::vector<Line>* lines) {
  for (const Event& event : kEvents) lines->push_back(Counted(sides, event));
  for (const Ratio& ratio : kRatios) lines->push_back(Measured(sides, ratio));
}

/// The lines of a row that changed; `adjusted` are all lines' p-values after Holm.
std::string RowText(const Sides& sides, const std::vector<Line>& lines,
                    const std::vector<double>& adjusted, size_t first) {
  std::string text;
  for (size_t i = first; i < first + std::size(kEvents) + std::size(kRatios); ++i) {
    const Line& line = lines[i];
    if (!line.better && !line.worse && line.test.p >= 1.0) continue;
    const char* way = !line.better && !line.worse ? "as before" : line.better ? "better" : "worse";
    text += fmt::format("  {:<15} {}: {}, p {:.3g}{}\n", line.what, line.text, way, line.test.p,
                        adjusted[i] < kLevel ? ", beyond chance" : "");
  }
  const std::string what = sides.paired
                               ? fmt::format("{} pairs", sides.now.flights.size())
                               : fmt::format("{} flights before, {} now, no pairs",
                                             sides.before.flights.size(), sides.now.flights.size());
  return fmt::format("{}: {}{}\n{}", sides.now.Title(), what, text.empty() ? ", no change" : "",
                     text);
}

/// The pairs of the pooled row whose outcome changed.
std::string Changed(const Sides& all) {
  if (!all.paired) return "";
  constexpr int kMost = 20;
  std::string text;
  int changed = 0;
  for (size_t i = 0; i < all.now.flights.size(); ++i) {
    const Json &before = *all.before.flights[i], &now = *all.now.flights[i];
    if (before["outcome"] == now["outcome"] || ++changed > kMost) continue;
    const std::string fault = now["fault"], why = now.value("why", std::string());
    text += fmt::format("  {}, seed {}{}: {} -> {}{}\n", now["scenario"].get<std::string>(),
                        now["seed"].get<int64_t>(), fault.empty() ? "" : ", " + fault,
                        before["outcome"].get<std::string>(), now["outcome"].get<std::string>(),
                        why.empty() ? "" : " (" + why + ")");
  }
  if (changed > kMost) text += fmt::format("  and {} more\n", changed - kMost);
  return changed == 0 ? "" : "Other outcome:\n" + text;
}

std::string Verdict(const std::vector<Line>& lines, const std::vector<double>& adjusted,
                    bool* any_worse) {
  std::string better, worse;
  for (size_t i = 0; i < lines.size(); ++i) {
    if (adjusted[i] >= kLevel || lines[i].better == lines[i].worse) continue;
    std::string& side = lines[i].better ? better : worse;
    side += fmt::format("{}{} of {} (p {:.2g} after Holm)", side.empty() ? "" : "; ", lines[i].what,
                        lines[i].row, adjusted[i]);
  }
  *any_worse = !worse.empty();
  return "Verdict: " + (worse.empty() ? "nothing worse beyond chance" : "WORSE: " + worse) +
         (better.empty() ? "" : "; better: " + better) + "\n";
}

Row Pooled(const std::vector<Row>& rows) {
  Row all{"all", "", {}};
  for (const Row& row : rows)
    all.flights.insert(all.flights.end(), row.flights.begin(), row.flights.end());
  return all;
}

}  // namespace

std::vector<Json> LoadFlights(const std::string& file_or_folder) {
  std::string file = file_or_folder;
  if (std::filesystem::is_directory(file)) file += "/flights.json";
  const Json json = Json::parse(ReadText(file), nullptr, false);
  if (!json.is_array()) throw std::runtime_error(file + ": is no list of flights (flights.json)");
  for (const Json& f : json)
    if (!f.is_object() || !f.contains("scenario") || !f["scenario"].is_string() ||
        !f.contains("fault") || !f["fault"].is_string() || !f.contains("seed") ||
        !f["seed"].is_number_integer() || !f.contains("outcome") || !f["outcome"].is_string() ||
        (f.contains("kind") && !f["kind"].is_string()))
      throw std::runtime_error(file +
                               ": a flight without scenario, fault, seed or outcome; "
                               "chase-campaign --out DIR makes DIR/flights.json");
  return json.get<std::vector<Json>>();
}

Comparison Compare(const std::vector<Json>& before, const std::vector<Json>& now) {
  const std::vector<Row> old_rows = RowsOf(before), rows = RowsOf(now);
  std::vector<Sides> all_sides;
  std::vector<Row> flown_before, flown_again;
  std::string unmatched;
  for (const Row& row : rows) {
    Row old{row.place, row.fault, {}};
    for (const Row& r : old_rows)
      if (r.place == row.place && r.fault == row.fault) old = r;
    if (old.flights.empty()) {
      unmatched += row.Title() + ": not flown before\n";
    } else {
      all_sides.push_back(SidesOf(old, row));
      flown_before.push_back(old);
      flown_again.push_back(row);
    }
  }
  if (all_sides.empty()) return {unmatched + "Verdict: nothing to compare\n", false};
  if (all_sides.size() > 1)  // of one row the same tests would count twice
    all_sides.push_back(SidesOf(Pooled(flown_before), Pooled(flown_again)));
  std::vector<Line> lines;
  std::vector<TestResult> tests;
  for (const Sides& sides : all_sides) AddLines(sides, &lines);
  for (const Line& line : lines) tests.push_back(line.test);
  const std::vector<double> adjusted = Holm(tests, kLevel);
  Comparison out;
  const size_t per_row = lines.size() / all_sides.size();
  for (size_t i = 0; i < all_sides.size(); ++i)
    out.text += RowText(all_sides[i], lines, adjusted, i * per_row);
  out.text += unmatched + Changed(all_sides.back()) + Verdict(lines, adjusted, &out.worse);
  return out;
}

}  // namespace chase::campaign
