#pragma once

#include <cstdint>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/logs/schema.h"

namespace chase::logs {

struct Record;

/// What one member of a message holds. Numbers and strings stay as they are on the wire.
struct Value {
  const Member* member = nullptr;  ///< of a Schema that outlives the value
  std::vector<int64_t> extents;    ///< of its dimensions; none: a scalar
  std::string bytes;               ///< all elements, unless they are structs
  std::vector<Record> records;     ///< all elements, if they are structs

  /// A list: its one dimension is another member's number.
  bool Varies() const;
  /// Of an integer member; its first element.
  int64_t Integer() const;
  /// Of integer members and bytes: all elements.
  std::vector<int64_t> Integers() const;
  /// All numbers; integers up to 2^53 are exact. Empty for strings and structs.
  std::vector<double> Numbers() const;
  /// Leaves alone strings, structs and an array of another fixed size.
  void SetNumbers(const std::vector<double>& numbers);
  /// Of a scalar string.
  std::string Text() const;
  void SetText(const std::string& text);
};

/// A message of a type that is known at run time only.
struct Record {
  std::map<std::string, Value> values;  ///< by the member's name

  const Value* Find(const std::string& member) const;
  /// The first of the member's numbers; 0 when there is none.
  double Number(const std::string& member) const;
  /// Sets a member's numbers, if there is such a member, and its length when that varies.
  void Set(const std::string& member, const std::vector<double>& numbers);
};

/// A message that is not what its fingerprint says.
struct Malformed : std::runtime_error {
  Malformed() : std::runtime_error("malformed message") {}
};

/// A message's bytes behind the fingerprint. Throws Malformed when they are not exactly one `type`.
Record Decode(const Schema& schema, const Struct& type, const std::string& bytes);
/// The inverse. `record` must hold all members of `type` with lengths that fit.
std::string Encode(const Schema& schema, const Struct& type, const Record& record);

/// Zeros and empty strings, in the numbers that `lengths` gives the varying dimensions by name; 0
/// for those that it does not name. Throws Malformed when that is beyond any message.
Value Zero(const Schema& schema, const Member& member,
           const std::map<std::string, int64_t>& lengths = {});
Record Zero(const Schema& schema, const Struct& type);

/// `value` in `size` bytes, most significant first.
std::string BigEndian(uint64_t value, int size);

}  // namespace chase::logs
