#include "logs/src/report_page.h"

#include "logs/src/output.h"
#include "logs/src/page_template.h"

namespace chase::logs {

void WritePage(const std::string& file, const std::string& template_file,
               const std::string& plotly_file, const ReportData& data,
               const std::string& metrics_json) {
  WriteFile(file, FillPage(template_file, {{"/*DATA*/null", Embedded(ToJson(data).dump())},
                                           {"/*METRICS*/null", Embedded(metrics_json)},
                                           {"/*PLOTLY*/", PlotlySource(plotly_file)}}));
}

}  // namespace chase::logs
