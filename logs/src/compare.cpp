#include "logs/src/compare.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "logs/src/figure_table.h"

namespace chase::logs {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kNotKnown = "not known";

bool Known(const std::string& text) { return !text.empty() && text != kNotKnown; }

/// The value under a key with points; null where there is none.
Json At(const Json& metrics, const std::string& key) {
  const size_t point = key.find('.');
  const auto found = metrics.find(key.substr(0, point));
  if (found == metrics.end()) return {};
  if (point == std::string::npos) return *found;
  return found->is_object() ? At(*found, key.substr(point + 1)) : Json();
}

/// Larger is worse.
double Badness(double value, Better better) {
  if (better == Better::kHigher) return -value;
  return better == Better::kLower ? value : std::abs(value - 1.0);
}

ComparedFigure Figure(const ShownFigure& shown, const Json& a, const Json& b, double tolerance) {
  const auto text = [&](const Json& v) {
    return v.is_number() ? shown.Text(v.get<double>()) : std::string();
  };
  ComparedFigure figure{shown.key, text(a), text(b)};
  if (!a.is_number() || !b.is_number()) return figure;
  const double before = a.get<double>(), after = b.get<double>();
  const double moved = Badness(after, *shown.better) - Badness(before, *shown.better);
  const double share = tolerance * std::max(std::abs(before), std::abs(after));
  figure.worse = moved > std::max(share, shown.HalfDigit());
  return figure;
}

}  // namespace

std::vector<ComparedFigure> CompareMetrics(const std::string& a, const std::string& b,
                                           double tolerance) {
  const Json before = Json::parse(a), after = Json::parse(b);
  std::vector<ComparedFigure> figures;
  for (const ShownFigure& shown : FigureTable())
    if (shown.better)
      figures.push_back(Figure(shown, At(before, shown.key), At(after, shown.key), tolerance));
  std::map<std::string, std::pair<std::string, std::string>> criteria;
  const auto word = [](const Json& passed) {
    return passed.is_null() ? kNotKnown : passed.get<bool>() ? "passed" : "FAILED";
  };
  const Json held_before = At(before, "criteria"), held_after = At(after, "criteria");
  for (const auto& [name, passed] : held_before.items()) criteria[name].first = word(passed);
  for (const auto& [name, passed] : held_after.items()) criteria[name].second = word(passed);
  for (const auto& [name, held] : criteria)
    figures.push_back({"criteria." + name, held.first, held.second,
                       held.first == "passed" && held.second == "FAILED"});
  return figures;
}

std::string Format(const std::vector<ComparedFigure>& figures) {
  const auto shown = [](const std::string& text) { return Known(text) ? text : kNotKnown; };
  std::string out = fmt::format("{:<30} {:>14} {:>14}\n", "", "A", "B");
  for (const ComparedFigure& f : figures)
    if (!f.a.empty() || !f.b.empty())
      out += fmt::format("{:<30} {:>14} {:>14}{}\n", f.key, shown(f.a), shown(f.b),
                         f.worse ? "  WORSE" : "");
  const auto count = [&](auto is) { return std::count_if(figures.begin(), figures.end(), is); };
  const auto worse = count([](const ComparedFigure& f) { return f.worse; });
  const auto lost = count([](const ComparedFigure& f) { return Known(f.a) && !Known(f.b); });
  out += worse == 0 ? "B is worse in nothing" : fmt::format("B is worse in {}", worse);
  return out + (lost == 0 ? "\n" : fmt::format("; not known of B: {}\n", lost));
}

}  // namespace chase::logs
