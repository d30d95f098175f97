#include "logs/src/page_template.h"

#include <filesystem>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace chase::logs {
namespace {

std::string ReadText(const std::string& file, const std::string& cure) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw std::runtime_error(file + ": not found; " + cure);
  return {std::istreambuf_iterator<char>(in), {}};
}

}  // namespace

std::string FillPage(const std::string& template_file,
                     const std::vector<std::pair<std::string, std::string>>& marks) {
  std::string page = ReadText(template_file, "build again");
  for (const auto& [mark, text] : marks) {
    const size_t at = page.find(mark);
    if (at == std::string::npos)
      throw std::runtime_error("the report's template has no " + mark + "; build again");
    page.replace(at, mark.size(), text);
  }
  return page;
}

std::string PartOfPage(const std::string& file) { return ReadText(file, "build again"); }

std::string Embedded(std::string json) {
  for (size_t at = 0; (at = json.find("</", at)) != std::string::npos; at += 3)
    json.replace(at, 2, "<\\/");
  return json;
}

std::string PlotlySource(const std::string& file) {
  return ReadText(file, "run npm ci --prefix logs in the source folder and build again");
}

std::string ShareFolder() {
  namespace fs = std::filesystem;
  return (fs::read_symlink("/proc/self/exe").parent_path().parent_path() / "share" / "chase")
      .string();
}

}  // namespace chase::logs
