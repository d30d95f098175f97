#include "logs/src/report_page.h"

#include "logs/src/figure_table.h"
#include "logs/src/output.h"
#include "logs/src/page_template.h"
#include "logs/src/playback.h"

namespace chase::logs {
namespace {

using Json = nlohmann::ordered_json;

Json DataOf(const std::vector<ReportedFlight>& flights,
            const std::vector<ComparedFigure>& compared) {
  Json data;
  data["flights"] = Json::array();
  for (const ReportedFlight& flight : flights) data["flights"].push_back(flight.page);
  data["rows"] = Json::array();
  for (const ShownFigure& f : FigureTable())
    data["rows"].push_back({f.key, f.words, f.unit, f.scale, f.digits});
  data["compared"] = Json::array();
  for (const ComparedFigure& f : compared)
    data["compared"].push_back({{"key", f.key}, {"a", f.a}, {"b", f.b}, {"worse", f.worse}});
  return data;
}

/// Text from a log need not be UTF-8.
std::string TextOf(const Json& json) {
  return Embedded(json.dump(-1, ' ', false, Json::error_handler_t::replace));
}

}  // namespace

void WritePage(const std::string& file, const std::string& share_folder,
               const std::vector<ReportedFlight>& flights,
               const std::vector<ComparedFigure>& compared) {
  const std::string share = share_folder + "/";
  WriteFile(file, FillPage(share + "report.html",
                           {{"/*STYLE*/", PartOfPage(share + "report.css")},
                            {"/*PLOTLY*/", PlotlySource(share + "plotly.min.js")},
                            {"/*DATA*/null", TextOf(DataOf(flights, compared))},
                            {"/*VIEWER*/null", TextOf(PlaybackPage(share_folder))},
                            {"/*PLAYBACK*/", PartOfPage(share + "report_playback.js")},
                            {"/*CHARTS*/", PartOfPage(share + "report_charts.js")},
                            {"/*REPORT*/", PartOfPage(share + "report.js")}}));
}

}  // namespace chase::logs
