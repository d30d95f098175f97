#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace chase::logs {

/// One dimension of an array: a number ("6"), or the name of an earlier integer member.
struct Dimension {
  std::string text;
  bool fixed = false;
};

struct Member {
  std::string name, type;
  std::vector<Dimension> dimensions;  ///< none: a scalar
};

struct Struct {
  std::string name;
  std::vector<Member> members;

  /// nullptr: it has none of that name.
  const Member* Find(const std::string& member) const;
};

/// Message definitions in LCM's language, read at run time.
class Schema {
 public:
  /// `text`: any number of structs in any order. Throws std::runtime_error with one line that names
  /// the line of the text, or the type that is not there or holds itself.
  explicit Schema(const std::string& text);

  const std::vector<Struct>& structs() const { return structs_; }
  /// nullptr: there is none of that name.
  const Struct* Find(const std::string& type) const;
  /// The first eight bytes of a message of this type, as lcm-gen computes them (lcmgen.c,
  /// lcm_struct_hash): from the members' names, primitive types and dimensions and the nested
  /// types' own hashes, not from the type's name.
  int64_t Fingerprint(const Struct& type) const;

 private:
  uint64_t Hash(const Struct& type, std::vector<std::string>* open) const;

  std::vector<Struct> structs_;
};

/// Bytes of one element on the wire; 0 for a string, -1 when `type` is no primitive type.
int PrimitiveSize(const std::string& type);
bool IsInteger(const std::string& type);

}  // namespace chase::logs
