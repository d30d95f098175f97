#include "logs/src/migrate.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "common/bus/log_writer.h"
#include "common/logs/log_reader.h"
#include "lcmtypes/lcm_texts.h"
#include "logs/src/info.h"
#include "logs/src/migrate_rules.h"

namespace chase::logs {
namespace {

constexpr size_t kFingerprintBytes = 8;

/// The varying dimensions may have other names.
bool SameForm(const Member& a, const Member& b) {
  const auto same = [](const Dimension& x, const Dimension& y) {
    return x.fixed == y.fixed && (!x.fixed || x.text == y.text);
  };
  return a.type == b.type && std::equal(a.dimensions.begin(), a.dimensions.end(),
                                        b.dimensions.begin(), b.dimensions.end(), same);
}

using Lengths = std::map<std::string, int64_t>;

/// Notes the array's lengths under the names that they have in `to`; false when another array has
/// them differently.
bool NoteLengths(const Member& to, const Value& array, Lengths* lengths) {
  Lengths with = *lengths;
  for (size_t i = 0; i < to.dimensions.size(); ++i) {
    const Dimension& d = to.dimensions[i];
    if (!d.fixed && with.emplace(d.text, array.extents[i]).first->second != array.extents[i])
      return false;
  }
  *lengths = with;
  return true;
}

std::set<std::string> LengthNames(const Struct& type) {
  std::set<std::string> names;
  for (const Member& m : type.members)
    for (const Dimension& d : m.dimensions)
      if (!d.fixed) names.insert(d.text);
  return names;
}

void SetLength(int64_t length, Value* value) {
  const int size = PrimitiveSize(value->member->type);
  value->bytes = BigEndian(static_cast<uint64_t>(length), size);
  if (value->Integer() != length) throw Malformed();  // more elements than can be told today
}

}  // namespace

Migrator::Migrator(const std::string& today, const std::vector<std::string>& history)
    : today_(today), history_(history.begin(), history.end()) {
  for (const Struct& s : today_.structs())
    known_.try_emplace(today_.Fingerprint(s), Known{&today_, &s});
  for (auto schema = history_.rbegin(); schema != history_.rend(); ++schema)
    for (const Struct& s : schema->structs())
      if (today_.Find(s.name)) known_.try_emplace(schema->Fingerprint(s), Known{&*schema, &s});
}

Fate Migrator::Migrate(const std::string& channel, std::vector<uint8_t>* message) const {
  if (message->size() < kFingerprintBytes) return Fate::kMalformed;
  uint64_t fingerprint = 0;
  for (size_t i = 0; i < kFingerprintBytes; ++i) fingerprint = fingerprint << 8 | (*message)[i];
  const auto known = known_.find(static_cast<int64_t>(fingerprint));
  if (known == known_.end()) return Fate::kUnknown;
  const auto& [schema, from] = known->second;
  if (schema == &today_) return Fate::kKept;
  try {
    const Struct& to = *today_.Find(from->name);
    const std::string body(message->begin() + kFingerprintBytes, message->end());
    const Record old = Decode(*schema, *from, body);
    const std::string out =
        BigEndian(static_cast<uint64_t>(today_.Fingerprint(to)), kFingerprintBytes) +
        Encode(today_, to, Convert(channel, to, old));
    message->assign(out.begin(), out.end());
    return Fate::kMigrated;
  } catch (const Malformed&) {
    return Fate::kMalformed;
  }
}

Record Migrator::Convert(const std::string& channel, const Struct& to, const Record& old) const {
  Record out;
  Lengths lengths;
  for (const Member& m : to.members) {
    const Value* was = old.Find(m.name);
    if (was && SameForm(*was->member, m) && NoteLengths(m, *was, &lengths))
      out.values.emplace(m.name, Carry(channel, m, *was));
  }
  for (const Member& m : to.members) {
    if (out.Find(m.name)) continue;
    Value value = Zero(today_, m, lengths);
    if (const Rule rule = RuleFor(to.name, m.name)) rule({channel, old}, &value);
    if (!NoteLengths(m, value, &lengths)) value = Zero(today_, m, lengths);
    out.values.emplace(m.name, std::move(value));
  }
  for (const std::string& name : LengthNames(to)) SetLength(lengths[name], &out.values.at(name));
  return out;
}

Value Migrator::Carry(const std::string& channel, const Member& to, const Value& old) const {
  Value value{&to, old.extents, old.bytes, {}};
  for (const Record& r : old.records)
    value.records.push_back(Convert(channel, *today_.Find(to.type), r));
  return value;
}

Migration MigrateLog(const std::string& in, const std::string& out) {
  const Migrator migrator(LcmToday(), LcmHistory());
  LogReader log(in);
  bus::LogWriter writer(out);
  Migration migration;
  for (LogEvent e; log.Next(&e);) {
    const Fate fate = migrator.Migrate(e.channel, &e.bytes);
    ++migration.channels[e.channel][fate];
    if (fate != Fate::kMalformed) writer.Write(e.utime, e.channel, e.bytes);
  }
  writer.Close();
  migration.damage = log.damage();
  return migration;
}

std::string Format(const Migration& migration) {
  static const std::map<Fate, const char*> words = {
      {Fate::kKept, "already of today, copied"},
      {Fate::kMigrated, "migrated"},
      {Fate::kUnknown, "of a type that no version had, copied unchanged"},
      {Fate::kMalformed, "malformed, left out"}};
  std::string text;
  for (const auto& [channel, fates] : migration.channels) {
    std::string parts;
    for (const auto& [fate, count] : fates)
      parts += fmt::format("{}{} {}", parts.empty() ? "" : "; ", count, words.at(fate));
    text += fmt::format("{:<20} {}\n", channel, parts);
  }
  for (const Damage& d : migration.damage) text += Format(d) + "\n";
  return text;
}

}  // namespace chase::logs
