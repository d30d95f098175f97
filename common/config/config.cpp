#include "common/config/config.h"

#include <fmt/format.h>

#include <algorithm>

namespace chase::config::detail {

namespace {

/// The entry of a map by its key or of a list by its number; undefined where there is none.
YAML::Node Child(const YAML::Node& node, const std::string& word) {
  if (node.IsMap()) return node[word];
  const bool number =
      !word.empty() && word.size() < 9 && word.find_first_not_of("0123456789") == std::string::npos;
  if (node.IsSequence() && number) return node[std::stoul(word)];
  return YAML::Node(YAML::NodeType::Undefined);
}

}  // namespace

void Fail(const std::string& origin, const YAML::Node& node, const std::string& what) {
  const int line = node.IsDefined() ? node.Mark().line : -1;
  const std::string where = line >= 0 ? fmt::format("{}:{}", origin, line + 1) : origin;
  throw std::runtime_error(where + ": " + what);
}

std::string TypeName(const bool*) { return "true or false"; }
std::string TypeName(const int*) { return "a whole number"; }
std::string TypeName(const int64_t*) { return "a whole number"; }
std::string TypeName(const double*) { return "a number"; }
std::string TypeName(const std::string*) { return "a text"; }

std::string FormatNumber(double value) {
  if (value != value) return ".nan";
  if (value - value != 0.0) return value > 0 ? ".inf" : "-.inf";
  return fmt::format("{}", value);
}

std::string Quoted(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '\n') {
      quoted += "\\n";
      continue;
    }
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
  }
  return quoted + "\"";
}

YAML::Node NamedBy(const std::string& problem, const YAML::Node& node) {
  constexpr const char* kSeparators = ".:[] ";
  const std::size_t end = std::min(problem.find_first_of(kSeparators), problem.size());
  const YAML::Node child = Child(node, problem.substr(0, end));
  if (!child.IsDefined()) return node;
  const std::size_t next = problem.find_first_not_of(kSeparators, end);
  const bool ends = next == problem.npos || problem[end] == ' ';
  return ends ? child : NamedBy(problem.substr(next), child);
}

void Reader::RefuseWrongKeys() const {
  std::set<std::string> seen;
  for (const auto& entry : node_) {
    if (!entry.first.IsScalar()) Fail(origin_, entry.first, path_ + ": a key is not a word");
    const std::string key = entry.first.Scalar();
    const std::string name = path_.empty() ? key : path_ + "." + key;
    if (!known_.count(key)) {
      std::string list;
      for (const auto& one : known_) list += (list.empty() ? "" : ", ") + one;
      Fail(origin_, entry.first, fmt::format("unknown key '{}'; known here: {}", name, list));
    }
    if (!seen.insert(key).second)
      Fail(origin_, entry.first, fmt::format("'{}' is given twice; keep one of them", name));
  }
}

YAML::Node ParseText(const std::string& text, const std::string& origin) {
  try {
    return YAML::Load(text);
  } catch (const YAML::ParserException& e) {
    throw std::runtime_error(fmt::format("{}:{}: {}", origin, e.mark.line + 1, e.msg));
  }
}

YAML::Node ParseFile(const std::string& file) {
  std::ifstream in(file);
  if (!in)
    throw std::runtime_error(
        fmt::format("{}: cannot be read; check the path and its rights", file));
  std::ostringstream text;
  text << in.rdbuf();
  return ParseText(text.str(), file);
}

}  // namespace chase::config::detail
