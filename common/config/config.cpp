#include "common/config/config.h"

#include <fmt/format.h>

namespace chase::config::detail {

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

void Reader::RefuseUnknownKeys() const {
  for (const auto& entry : node_) {
    const std::string key = entry.first.as<std::string>();
    if (known_.count(key)) continue;
    std::string list;
    for (const auto& name : known_) list += (list.empty() ? "" : ", ") + name;
    Fail(origin_, entry.first,
         fmt::format("unknown key '{}'; known here: {}", path_.empty() ? key : path_ + "." + key,
                     list));
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
