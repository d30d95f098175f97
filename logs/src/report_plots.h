#pragma once

#include <string>

#include "logs/src/report_data.h"

namespace chase::logs {

/// Draws top_view, distance, visibility, clearance, pixels, stages and cpu as PNG files in `folder`
/// with gnuplot, without truth top_view, timeline, distance, certificate, tracking, uncertainty,
/// latency, stages and cpu; a picture without data is left out. Throws std::runtime_error with one
/// line.
void WritePlots(const std::string& folder, const ReportData& data);

}  // namespace chase::logs
