#pragma once

#include <string>
#include <vector>

#include "logs/src/compare.h"
#include "logs/src/reported_flight.h"

namespace chase::logs {

/// Writes one self-contained HTML page of one flight, or of two that are compared: report.html of
/// `share_folder` with report.css, report.js, Plotly, the viewer's page and the data inside. Throws
/// std::runtime_error with one line.
void WritePage(const std::string& file, const std::string& share_folder,
               const std::vector<ReportedFlight>& flights,
               const std::vector<ComparedFigure>& compared = {});

}  // namespace chase::logs
