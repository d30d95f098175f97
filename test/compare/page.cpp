#include <algorithm>

#include "deploy/campaign/text_file.h"
#include "logs/src/page_template.h"
#include "test/compare/figure.h"

namespace chase::compare {
namespace {

using Json = nlohmann::ordered_json;

Json PanelData(const Flights& flights) {
  Json panels = Json::array();
  for (const Panel& p : Panels()) {
    Json lines = Json::array();
    const auto planners = PlannersOf(flights);
    for (size_t k = 0; k < planners.size(); ++k) {
      Json x = Json::array(), y = Json::array();
      for (const Json& f : flights) {
        if (PlannerOf(f) != planners[k]) continue;
        x.push_back(f["metrics"]["scenario"]);
        y.push_back(p.value(f["metrics"]));
      }
      lines.push_back(
          {{"name", planners[k]}, {"color", ColorOf(planners[k], k)}, {"x", x}, {"y", y}});
    }
    panels.push_back({{"title", p.title}, {"log", p.logarithmic}, {"lines", lines}});
  }
  return panels;
}

Json Rows(const Flights& flights) {
  Json rows = Json::array();
  for (const Json& f : flights) {
    Json row = {{"scenario", f["metrics"]["scenario"]}, {"planner", PlannerOf(f)}};
    for (const Panel& p : Panels()) row["values"].push_back(p.value(f["metrics"]));
    row["lapses"] = f["metrics"]["lapses"].size();
    rows.push_back(row);
  }
  return rows;
}

Json TopViews(const Flights& flights, const std::vector<std::string>& scenarios) {
  Json views = Json::array();
  const auto planners = PlannersOf(flights);
  for (const std::string& scenario : scenarios) {
    Json view = {{"scenario", scenario}, {"paths", Json::array()}};
    for (const Json& f : flights) {
      if (f["metrics"]["scenario"] != scenario) continue;
      view["obstacles"] = f["obstacles"];
      const auto at = std::find(planners.begin(), planners.end(), PlannerOf(f));
      view["paths"].push_back({{"name", *at},
                               {"color", ColorOf(*at, static_cast<size_t>(at - planners.begin()))},
                               {"track", f["track"]}});
    }
    views.push_back(view);
  }
  return views;
}

}  // namespace

void WritePage(const Flights& flights, const std::vector<std::string>& top_views,
               const std::string& file) {
  const Json data = {{"panels", PanelData(flights)},
                     {"rows", Rows(flights)},
                     {"views", TopViews(flights, top_views)}};
  const std::string share = logs::ShareFolder();
  campaign::WriteText(
      file, logs::FillPage(share + "/comparison.html",
                           {{"/*DATA*/null", logs::Embedded(data.dump())},
                            {"/*PLOTLY*/", logs::PlotlySource(share + "/plotly.min.js")}}));
}

}  // namespace chase::compare
