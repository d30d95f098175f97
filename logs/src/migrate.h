#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "common/logs/log_reader.h"
#include "common/logs/record.h"
#include "common/logs/schema.h"

namespace chase::logs {

enum class Fate { kKept, kMigrated, kUnknown, kMalformed };

/// Brings messages of older versions to today's: members of the same name and declaration are
/// carried over, nested structs member by member; the others are zero, empty, or what
/// migrate_rules.h says of them. Varying lengths are those of the arrays.
class Migrator {
 public:
  /// Texts of message definitions; `history` oldest first. Throws std::runtime_error as Schema
  /// does.
  Migrator(const std::string& today, const std::vector<std::string>& history);
  Migrator(const Migrator&) = delete;  // known_ points into the schemas
  Migrator& operator=(const Migrator&) = delete;

  /// Replaces `message` if it is of an older version and leaves it alone if not.
  Fate Migrate(const std::string& channel, std::vector<uint8_t>* message) const;

 private:
  struct Known {
    const Schema* schema;
    const Struct* type;
  };
  Record Convert(const std::string& channel, const Struct& to, const Record& old) const;
  Value Carry(const std::string& channel, const Member& to, const Value& old) const;

  Schema today_;
  std::vector<Schema> history_;
  std::map<int64_t, Known> known_;  ///< by fingerprint; today's win over older ones
};

struct Migration {
  std::map<std::string, std::map<Fate, long>> channels;  ///< messages of each
  std::vector<Damage> damage;                            ///< what could not be read
};

/// Writes the log `in` anew as `out` with today's messages. Stamps, channels and the order stay;
/// what is unknown is copied, what is malformed left out. Throws std::runtime_error with one line.
Migration MigrateLog(const std::string& in, const std::string& out);

/// One line per channel, for people.
std::string Format(const Migration& migration);

}  // namespace chase::logs
