#pragma once

#include <string>
#include <utility>
#include <vector>

namespace chase::logs {

/// `template_file` with the first of each mark replaced by its text. Throws std::runtime_error with
/// one line when a mark is not there.
std::string FillPage(const std::string& template_file,
                     const std::vector<std::pair<std::string, std::string>>& marks);

/// A style sheet or a script that a template is filled with.
std::string PartOfPage(const std::string& file);

/// JSON that may stand inside a script element.
std::string Embedded(std::string json);

/// The Plotly library, or an error that says how to get it.
std::string PlotlySource(const std::string& file);

/// share/chase beside the folder of this program: templates and Plotly.
std::string ShareFolder();

}  // namespace chase::logs
