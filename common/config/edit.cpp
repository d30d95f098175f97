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

/// Lines that hold the keys of one map.
struct Block {
  std::size_t begin, end;
  std::string indent;
  std::size_t otherwise;  ///< before this one a key goes that has no line
};

/// The number of the block's line that begins so, or its end.
std::size_t Find(const Lines& lines, const Block& block, const std::string& head) {
  std::size_t i = block.begin;
  while (i < block.end && !Begins(lines[i], head)) ++i;
  return i;
}

/// The number behind the line that has the key commented out, or `otherwise`.
std::size_t BehindCommented(const Lines& lines, const Block& block, const std::string& key) {
  for (const char* mark : {"#", "# "}) {
    const std::size_t at = Find(lines, block, mark + block.indent + key + ":");
    if (at < block.end) return at + 1;
  }
  return block.otherwise;
}

std::string CommentOf(const std::string& line) {
  const std::size_t at = line.find(" #");
  const std::size_t first = at == std::string::npos ? at : line.find_first_not_of(" #", at);
  return first == std::string::npos ? "" : line.substr(first);
}

std::string LineOf(const Change& change, const std::string& comment) {
  return change.key + ": " + change.value + (comment.empty() ? "" : "  # " + comment);
}

void Insert(Lines* lines, std::size_t before, const std::string& line) {
  lines->insert(lines->begin() + static_cast<std::ptrdiff_t>(before), line);
}

void Set(Lines* lines, const Block& block, const Change& change) {
  if (const std::size_t at = Find(*lines, block, block.indent + change.key + ":"); at < block.end) {
    std::string& line = (*lines)[at];
    const std::string own = change.comment.substr(0, change.comment.find(':'));
    const std::string old = CommentOf(line);
    const bool anew = old.empty() || (!own.empty() && Begins(old, own));
    line = block.indent + LineOf(change, anew ? change.comment : old);
  } else {
    Insert(lines, BehindCommented(*lines, block, change.key),
           block.indent + LineOf(change, change.comment));
  }
}

/// What is below the outermost `parent`, which gets a line where it has none.
Block Below(const std::string& parent, const Block& all, Lines* lines) {
  std::size_t at = Find(*lines, all, parent + ":");
  if (at == all.end) Insert(lines, at = BehindCommented(*lines, all, parent), parent + ":");
  Block block{at + 1, at + 1, "", at + 1};
  for (; block.end < lines->size(); ++block.end) {
    const std::string& line = (*lines)[block.end];
    const std::size_t first = line.find_first_not_of(" \r");
    if (first == std::string::npos || line[first] == '#') continue;
    if (first == 0) break;
    if (block.indent.empty()) block.indent.assign(first, ' ');
  }
  if (block.indent.empty()) block.indent = "  ";
  return block;
}

}  // namespace

std::string Edited(std::string text, const Change& change) {
  Lines lines = Split(text);
  Block block{0, lines.size(), "", lines.size()};
  Change within = change;
  if (const std::size_t dot = change.key.find('.'); dot != std::string::npos) {
    block = Below(change.key.substr(0, dot), block, &lines);
    within.key = change.key.substr(dot + 1);
  }
  Set(&lines, block, within);
  text.clear();
  for (const std::string& line : lines) text += line + "\n";
  return text;
}

}  // namespace chase::config::detail
