#include "common/config/changes.h"

namespace chase::config::detail {

namespace {

/// The items of a flow sequence "[a, b]", each with the comma after it.
std::vector<std::string> Items(const std::string& flow) {
  std::vector<std::string> items = {""};
  int depth = 0;
  bool quoted = false;
  for (std::size_t i = 0; i < flow.size(); ++i) {
    const char c = flow[i];
    if (c == '"' && (i == 0 || flow[i - 1] != '\\')) quoted = !quoted;
    if (!quoted) depth += c == '[' || c == '{' ? 1 : c == ']' || c == '}' ? -1 : 0;
    if (!quoted && depth == 1 && c == ' ' && flow[i - 1] == ',')
      items.emplace_back();
    else
      items.back() += c;
  }
  return items;
}

}  // namespace

/// A literal block scalar; what it could not give back, quoted.
std::string ChangesWriter::Block(const std::string& lines) const {
  const bool plain = lines.size() > 1 && lines.back() == '\n' && lines[lines.size() - 2] != '\n' &&
                     lines.front() != ' ' && lines.front() != '\n';
  if (!plain) return " " + Quoted(lines) + "\n";
  std::string text = " |\n" + pad_ + "  ";
  for (std::size_t i = 0; i < lines.size(); ++i) {
    text += lines[i];
    if (lines[i] == '\n' && i + 1 < lines.size()) text += pad_ + "  ";
  }
  return text;
}

/// The flow text in lines of kLineWidth, broken between the items of a list.
std::string ChangesWriter::Wrapped(const std::string& flow, std::size_t used) const {
  std::string text;
  std::size_t column = pad_.size() + used;
  for (const auto& item : Items(flow)) {
    const bool first = text.empty();
    const bool fits = column + 1 + item.size() <= kLineWidth;
    text += first ? item : fits ? " " + item : "\n" + pad_ + "  " + item;
    column = fits || first ? column + 1 + item.size() : pad_.size() + 2 + item.size();
  }
  return text + "\n";
}

}  // namespace chase::config::detail
