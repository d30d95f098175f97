#pragma once

#include <string>

#include "logs/src/report_data.h"

namespace chase::logs {

/// Writes one self-contained HTML page: `template_file` with the data and the Plotly library inside
/// it. Throws std::runtime_error with one line.
void WritePage(const std::string& file, const std::string& template_file,
               const std::string& plotly_file, const ReportData& data,
               const std::string& metrics_json);

}  // namespace chase::logs
