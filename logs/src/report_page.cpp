#include "logs/src/report_page.h"

#include <fstream>
#include <iterator>
#include <stdexcept>

#include "logs/src/output.h"

namespace chase::logs {
namespace {

std::string ReadText(const std::string& file, const std::string& cure) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error(file + ": not found; " + cure);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Replaces the first `mark` by `text`.
void Fill(std::string* page, const std::string& mark, const std::string& text) {
  const size_t at = page->find(mark);
  if (at == std::string::npos)
    throw std::runtime_error("the report's template has no " + mark + "; build again");
  page->replace(at, mark.size(), text);
}

/// JSON that may stand inside a script element.
std::string Embedded(std::string json) {
  for (size_t at = 0; (at = json.find("</", at)) != std::string::npos; at += 3)
    json.replace(at, 2, "<\\/");
  return json;
}

}  // namespace

void WritePage(const std::string& file, const std::string& template_file,
               const std::string& plotly_file, const ReportData& data,
               const std::string& metrics_json) {
  std::string page = ReadText(template_file, "build again");
  Fill(&page, "/*DATA*/null", Embedded(ToJson(data).dump()));
  Fill(&page, "/*METRICS*/null", Embedded(metrics_json));
  Fill(&page, "/*PLOTLY*/",
       ReadText(plotly_file, "run npm ci --prefix logs in the source folder and build again"));
  WriteFile(file, page);
}

}  // namespace chase::logs
