#include "common/logs/schema.h"

#include <algorithm>
#include <cctype>
#include <map>
#include <stdexcept>

namespace chase::logs {
namespace {

bool IsWord(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '_'; }
bool IsSpace(char c) { return std::isspace(static_cast<unsigned char>(c)) != 0; }

/// The text's words and signs, one after the other.
class Tokens {
 public:
  explicit Tokens(const std::string& text) : text_(text) { Next(); }

  bool AtEnd() const { return token_.empty(); }
  /// Steps over `token` if it is next.
  bool Take(const std::string& token) {
    if (token_ != token) return false;
    Next();
    return true;
  }
  void Require(const std::string& token) {
    if (!Take(token)) Fail("expected '" + token + "'");
  }
  std::string Word(const std::string& what) {
    if (AtEnd() || !IsWord(token_[0])) Fail("expected " + what);
    const std::string word = token_;
    Next();
    return word;
  }
  void SkipTo(const std::string& token) {
    while (!AtEnd() && token_ != token) Next();
    Require(token);
  }
  [[noreturn]] void Fail(const std::string& problem) const {
    const std::string at = AtEnd() ? ", the text ends" : ", found '" + token_ + "'";
    throw std::runtime_error("line " + std::to_string(line_) + ": " + problem + at);
  }

 private:
  void Next() {
    SkipBlank();
    const size_t begin = at_;
    while (at_ < text_.size() && IsWord(text_[at_])) ++at_;
    if (at_ == begin && at_ < text_.size()) ++at_;
    token_ = text_.substr(begin, at_ - begin);
  }
  void SkipBlank() {
    for (;;) {
      while (at_ < text_.size() && IsSpace(text_[at_])) Step(1);
      if (text_.compare(at_, 2, "//") == 0)
        Step(text_.find('\n', at_) - at_);
      else if (text_.compare(at_, 2, "/*") == 0)
        Step(std::max(text_.find("*/", at_ + 2), at_) - at_), Step(2);
      else
        return;
    }
  }
  void Step(size_t count) {
    const size_t end = count > text_.size() - at_ ? text_.size() : at_ + count;
    for (; at_ < end; ++at_) line_ += text_[at_] == '\n';
  }

  const std::string& text_;
  std::string token_;
  size_t at_ = 0;
  long line_ = 1;
};

Dimension ParseDimension(const Struct& type, Tokens* tokens) {
  const std::string text = tokens->Word("an array's size");
  if (std::isdigit(static_cast<unsigned char>(text[0])) != 0) {
    if (text.size() > 9 || text.find_first_not_of("0123456789") != std::string::npos || text == "0")
      tokens->Fail("'" + text + "' is no size of an array");
    return {text, true};
  }
  const Member* length = type.Find(text);
  if (!length || !length->dimensions.empty() || !IsInteger(length->type))
    tokens->Fail("the array's size '" + text + "' is no integer member before it");
  return {text, false};
}

void ParseMembers(Struct* type, Tokens* tokens) {
  std::string member_type = tokens->Word("a member's type");
  while (tokens->Take(".")) member_type = tokens->Word("a type");  // package.type
  do {
    Member member{tokens->Word("a member's name"), member_type, {}};
    if (type->Find(member.name)) tokens->Fail("a second member '" + member.name + "'");
    while (tokens->Take("[")) {
      member.dimensions.push_back(ParseDimension(*type, tokens));
      tokens->Require("]");
    }
    type->members.push_back(std::move(member));
  } while (tokens->Take(","));
  tokens->Require(";");
}

Struct ParseStruct(Tokens* tokens) {
  Struct type{tokens->Word("a struct's name"), {}};
  tokens->Require("{");
  while (!tokens->Take("}")) {
    if (tokens->Take("const"))
      tokens->SkipTo(";");
    else
      ParseMembers(&type, tokens);
  }
  return type;
}

/// Signed, as in lcmgen.c: the shift to the right brings the sign with it.
void Mix(int64_t value, int64_t* hash) {
  const uint64_t mixed = (static_cast<uint64_t>(*hash) << 8) ^ static_cast<uint64_t>(*hash >> 55);
  *hash = static_cast<int64_t>(mixed + static_cast<uint64_t>(value));
}

void Mix(const std::string& text, int64_t* hash) {
  Mix(static_cast<int64_t>(text.size()), hash);
  for (const char c : text) Mix(static_cast<int64_t>(c), hash);
}

}  // namespace

const Member* Struct::Find(const std::string& member) const {
  const auto it = std::find_if(members.begin(), members.end(),
                               [&](const Member& m) { return m.name == member; });
  return it == members.end() ? nullptr : &*it;
}

Schema::Schema(const std::string& text) {
  Tokens tokens(text);
  while (!tokens.AtEnd()) {
    if (tokens.Take("package")) {
      tokens.SkipTo(";");
      continue;
    }
    tokens.Require("struct");
    Struct type = ParseStruct(&tokens);
    if (Find(type.name)) tokens.Fail("a second struct '" + type.name + "'");
    structs_.push_back(std::move(type));
  }
  for (const Struct& type : structs_) Fingerprint(type);  // throws where a type is missing
}

const Struct* Schema::Find(const std::string& type) const {
  const auto it = std::find_if(structs_.begin(), structs_.end(),
                               [&](const Struct& s) { return s.name == type; });
  return it == structs_.end() ? nullptr : &*it;
}

int64_t Schema::Fingerprint(const Struct& type) const {
  std::vector<std::string> open;
  return static_cast<int64_t>(Hash(type, &open));
}

uint64_t Schema::Hash(const Struct& type, std::vector<std::string>* open) const {
  if (std::find(open->begin(), open->end(), type.name) != open->end())
    throw std::runtime_error(type.name + " holds itself");
  open->push_back(type.name);
  int64_t own = 0x12345678;
  uint64_t nested = 0;
  for (const Member& m : type.members) {
    Mix(m.name, &own);
    const Struct* inner = Find(m.type);
    if (PrimitiveSize(m.type) >= 0)
      Mix(m.type, &own);
    else if (inner)
      nested += Hash(*inner, open);
    else
      throw std::runtime_error(type.name + "." + m.name + ": there is no type '" + m.type + "'");
    Mix(static_cast<int64_t>(m.dimensions.size()), &own);
    for (const Dimension& d : m.dimensions) {
      Mix(d.fixed ? 0 : 1, &own);
      Mix(d.text, &own);
    }
  }
  open->pop_back();
  const uint64_t sum = static_cast<uint64_t>(own) + nested;
  return sum << 1 | sum >> 63;
}

int PrimitiveSize(const std::string& type) {
  static const std::map<std::string, int> sizes = {{"int8_t", 1},  {"byte", 1},    {"boolean", 1},
                                                   {"int16_t", 2}, {"int32_t", 4}, {"float", 4},
                                                   {"int64_t", 8}, {"double", 8},  {"string", 0}};
  const auto it = sizes.find(type);
  return it == sizes.end() ? -1 : it->second;
}

bool IsInteger(const std::string& type) {
  return type == "int8_t" || type == "int16_t" || type == "int32_t" || type == "int64_t";
}

}  // namespace chase::logs
