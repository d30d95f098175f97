#include "deploy/campaign/flight_list.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <map>
#include <set>
#include <sstream>
#include <stdexcept>

#include "common/world/fault.h"
#include "common/world/scenario.h"
#include "deploy/campaign/text_file.h"
#include "deploy/flight/scenario_file.h"

namespace chase::campaign {
namespace {

namespace fs = std::filesystem;

const std::string kWorld = "world:";
constexpr size_t kMostFlights = 1000000;  // more would not fit a results file that can be read

bool Contains(const std::vector<std::string>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

std::string Trimmed(const std::string& text) {
  const size_t first = text.find_first_not_of(" \t\r");
  if (first == std::string::npos) return "";
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

std::vector<std::string> Split(const std::string& text, char mark) {
  std::vector<std::string> parts;
  std::istringstream in(text);
  for (std::string part; std::getline(in, part, mark);) parts.push_back(Trimmed(part));
  return parts;
}

int64_t Seed(const std::string& text, const std::string& all) {
  constexpr int64_t kGreatest = 2147483647;  // chase-flight's
  int64_t seed = -1;
  const char* end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, seed);
  if (error != std::errc() || at != end || seed < 0 || seed > kGreatest)
    throw std::runtime_error(fmt::format(
        "seeds '{}': '{}' is no seed from 0 to {}; use 1-20 or 1,5,9", all, text, kGreatest));
  return seed;
}

std::string CheckedFault(const std::string& fault) {
  if (fault.empty() || fault == "none") return "";
  try {
    world::ParseFault(fault);
  } catch (const std::exception& e) {
    throw std::runtime_error("fault '" + fault + "': " + e.what());
  }
  return fault;
}

/// A random world or a scenario by the text that names it, without seed and fault.
Flight PlaceOf(const std::string& text) {
  Flight flight;
  if (text.rfind(kWorld, 0) != 0) {
    flight.file = flight::ScenarioFile(text);
    flight.scenario = fs::path(flight.file).stem();
    world::LoadScenario(flight.file);  // what cannot be flown is said before the first flight
    return flight;
  }
  flight.kind = text.substr(kWorld.size());
  if (!Contains(Kinds(), flight.kind))
    throw std::runtime_error(
        fmt::format("no kind of world '{}'; use {}", flight.kind, fmt::join(Kinds(), ", ")));
  return flight;
}

/// Collects flights, each once; refuses two scenario files of one name.
class List {
 public:
  void Add(const std::string& place, int64_t seed, const std::string& fault) {
    const auto at = places_.find(place);
    Flight flight = at != places_.end() ? at->second : (places_[place] = PlaceOf(place));
    flight.seed = seed;
    flight.fault = CheckedFault(fault);
    if (!flight.kind.empty()) flight.scenario = fmt::format("{}-{}", flight.kind, seed);
    const auto& file = files_.emplace(flight.Place(), flight.file).first->second;
    if (file != flight.file)
      throw std::runtime_error(fmt::format(
          "{}: has the same name as {}; results would overwrite each other", flight.file, file));
    if (!names_.insert(flight.Name()).second) return;
    if (flights.size() == kMostFlights)
      throw std::runtime_error(
          fmt::format("more than {} flights; use fewer seeds, faults or scenarios", kMostFlights));
    flights.push_back(flight);
  }

  std::vector<Flight> flights;

 private:
  std::map<std::string, Flight> places_;
  std::map<std::string, std::string> files_;
  std::set<std::string> names_;
};

void AddLine(const std::string& line, List* list) {
  const std::string text = Trimmed(line.substr(0, line.find('#')));
  if (text.empty()) return;
  const auto parts = Split(text, ',');
  if (parts.size() < 2 || parts.size() > 3)
    throw std::runtime_error("'" + text + "' is not scenario,seed,fault");
  list->Add(parts[0], Seed(parts[1], parts[1]), parts.size() > 2 ? parts[2] : "");
}

std::vector<Flight> FromFile(const std::string& file) {
  List list;
  std::istringstream in(ReadText(file));
  int number = 0;
  for (std::string line; std::getline(in, line);) {
    ++number;
    try {
      AddLine(line, &list);
    } catch (const std::exception& e) {
      throw std::runtime_error(fmt::format("{}:{}: {}", file, number, e.what()));
    }
  }
  if (list.flights.empty())
    throw std::runtime_error(file + ": names no flights; one a line: scenario,seed,fault");
  return list.flights;
}

std::vector<std::string> Expanded(const std::vector<std::string>& given,
                                  const std::vector<std::string>& all) {
  std::vector<std::string> names;
  for (const std::string& name : given) {
    if (name == "all") {
      names.insert(names.end(), all.begin(), all.end());
    } else {
      names.push_back(name);
    }
  }
  return names;
}

/// Those that can strike a flight of the place.
std::vector<std::string> FaultNames(const std::string& place) {
  const bool sensors =  // a random world's are used
      place.rfind(kWorld, 0) == 0 ||
      world::LoadScenario(flight::ScenarioFile(place)).sensors.mode != "truth";
  std::vector<std::string> names;
  for (const world::FaultKind& kind : world::FaultKinds())
    if (world::Misfit(kind, sensors).empty()) names.push_back(kind.name);
  return names;
}

}  // namespace

std::string Flight::Name() const {
  return fmt::format("{}{}_{}{}{}", kind.empty() ? "" : "world-", kind.empty() ? scenario : kind,
                     seed, fault.empty() ? "" : "_", fault);
}

const std::vector<std::string>& Kinds() {
  static const std::vector<std::string> kinds = {"hall",  "office", "corridor", "forest",
                                                 "grove", "park",   "field",    "street",
                                                 "yard",  "slope",  "crowd",    "mixed"};
  return kinds;
}

std::vector<int64_t> Seeds(const std::string& text) {
  std::vector<int64_t> seeds;
  for (const std::string& part : Split(text, ',')) {
    const size_t dash = part.find('-', 1);
    const int64_t first = Seed(part.substr(0, dash), text);
    const int64_t last = dash == std::string::npos ? first : Seed(part.substr(dash + 1), text);
    if (last < first || last - first >= static_cast<int64_t>(kMostFlights))
      throw std::runtime_error(fmt::format(
          "seeds '{}': '{}' is no range of at most {} seeds; use 1-20", text, part, kMostFlights));
    for (int64_t seed = first; seed <= last; ++seed) seeds.push_back(seed);
  }
  if (seeds.empty()) throw std::runtime_error("seeds '" + text + "': none; use 1-20 or 1,5,9");
  return seeds;
}

std::vector<Flight> Flights(const Request& request) {
  if (!request.flights_file.empty()) return FromFile(request.flights_file);
  std::vector<std::string> places = request.scenarios;
  for (const std::string& kind : Expanded(request.kinds, Kinds())) places.push_back(kWorld + kind);
  if (places.empty()) places.emplace_back("gym");
  const std::vector<int64_t> seeds = Seeds(request.seeds);
  List list;
  for (const std::string& place : places) {
    std::vector<std::string> faults = Expanded(request.faults, FaultNames(place));
    if (faults.empty()) faults.emplace_back("none");
    for (const std::string& fault : faults)
      for (const int64_t seed : seeds) list.Add(place, seed, fault);
  }
  return list.flights;
}

}  // namespace chase::campaign
