#include "common/config/edit.h"

#include <sstream>

namespace chase::config::detail {
namespace {

using Lines = std::vector<std::string>;

Lines Split(const std::string& text) {
  Lines lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

bool Begins(const std::string& text, const std::string& with) { return text.rfind(with, 0) == 0; }

/// The number of the line that begins so, or of lines.
std::size_t Find(const Lines& lines, const std::string& head) {
  std::size_t i = 0;
  while (i < lines.size() && !Begins(lines[i], head)) ++i;
  return i;
}

std::string CommentOf(const std::string& line) {
  const std::size_t at = line.find(" #");
  const std::size_t first = at == std::string::npos ? at : line.find_first_not_of(" #", at);
  return first == std::string::npos ? "" : line.substr(first);
}

std::string LineOf(const Change& change, const std::string& comment) {
  return change.key + ": " + change.value + (comment.empty() ? "" : "  # " + comment);
}

}  // namespace

std::string Edited(std::string text, const Change& change) {
  Lines lines = Split(text);
  if (const std::size_t at = Find(lines, change.key + ":"); at < lines.size()) {
    const std::string own = change.comment.substr(0, change.comment.find(':'));
    const std::string old = CommentOf(lines[at]);
    const bool anew = old.empty() || (!own.empty() && Begins(old, own));
    lines[at] = LineOf(change, anew ? change.comment : old);
  } else {
    std::size_t below = Find(lines, "#" + change.key + ":");
    if (below == lines.size()) below = Find(lines, "# " + change.key + ":");
    if (below < lines.size()) ++below;
    lines.insert(lines.begin() + static_cast<std::ptrdiff_t>(below),
                 LineOf(change, change.comment));
  }
  text.clear();
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

}  // namespace chase::config::detail
