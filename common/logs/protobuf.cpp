#include "common/logs/protobuf.h"

#include <algorithm>
#include <cstring>
#include <map>
#include <set>
#include <vector>

namespace chase::logs {
namespace {

enum WireType { kVarint = 0, kFixed64 = 1, kLengthDelimited = 2, kFixed32 = 5 };
// descriptor.proto, FieldDescriptorProto
enum FieldType {
  kDouble = 1,
  kFloat = 2,
  kInt64 = 3,
  kInt32 = 5,
  kBool = 8,
  kString = 9,
  kMessage = 11,
  kBytes = 12
};
enum Label { kOptional = 1, kRepeated = 3 };

FieldType TypeOf(const Member& m) {
  if (m.type == "byte" && !m.dimensions.empty()) return kBytes;
  static const std::map<std::string, FieldType> types = {
      {"double", kDouble}, {"float", kFloat},   {"int64_t", kInt64},
      {"int32_t", kInt32}, {"int16_t", kInt32}, {"int8_t", kInt32},
      {"byte", kInt32},    {"boolean", kBool},  {"string", kString}};
  const auto found = types.find(m.type);
  return found == types.end() ? kMessage : found->second;
}

bool IsLength(const Struct& type, const Member& member) {
  for (const Member& m : type.members)
    for (const Dimension& d : m.dimensions)
      if (!d.fixed && d.text == member.name) return true;
  return false;
}

/// Calls f(number, member) for what becomes a field.
template <class F>
void ForEachField(const Struct& type, const F& f) {
  int number = 0;
  for (const Member& m : type.members)
    if (!IsLength(type, m)) f(++number, m);
}

bool IsProtobufsOwn(const std::string& type) { return type == "Timestamp" || type == "Duration"; }

Proto Field(int number, const Member& m, const std::string& package) {
  const FieldType type = TypeOf(m);
  Proto field;
  field.Bytes(1, m.name)
      .Int(3, number)
      .Int(4, m.dimensions.empty() || type == kBytes ? kOptional : kRepeated)
      .Int(5, type);
  if (type == kMessage)
    field.Bytes(6, "." + (IsProtobufsOwn(m.type) ? "google.protobuf" : package) + "." + m.type);
  return field;
}

void Reach(const Schema& schema, const Struct& type, std::set<std::string>* names) {
  if (!names->insert(type.name).second) return;
  for (const Member& m : type.members)
    if (const Struct* inner = schema.Find(m.type)) Reach(schema, *inner, names);
}

Proto Message(const Struct& type, const std::string& package) {
  Proto message;
  message.Bytes(1, type.name);
  ForEachField(type,
               [&](int number, const Member& m) { message.Put(2, Field(number, m, package)); });
  return message;
}

std::string LittleEndian(const std::string& bytes, size_t size) {
  std::string out = bytes;
  for (size_t at = 0; at + size <= out.size(); at += size)
    std::reverse(out.begin() + static_cast<long>(at), out.begin() + static_cast<long>(at + size));
  return out;
}

/// Strings on the wire: length with the zero at the end, text, zero.
void PutStrings(int number, const std::string& bytes, Proto* out) {
  for (size_t at = 0; at + 4 < bytes.size();) {
    size_t length = 0;
    for (size_t i = 0; i < 4; ++i) length = length << 8 | static_cast<uint8_t>(bytes[at + i]);
    out->Bytes(number, bytes.substr(at + 4, length - 1));
    at += 4 + length;
  }
}

void PutValue(const Schema& schema, int number, const Value& value, Proto* out) {
  const Member& m = *value.member;
  const bool list = !m.dimensions.empty();
  switch (TypeOf(m)) {
    case kMessage:
      for (const Record& r : value.records)
        out->Put(number, ToProto(schema, *schema.Find(m.type), r));
      return;
    case kString:
      return PutStrings(number, value.bytes, out);
    case kBytes:
      out->Bytes(number, value.bytes);
      return;
    case kDouble:
    case kFloat: {
      const auto size = static_cast<size_t>(PrimitiveSize(m.type));
      const std::string bytes = LittleEndian(value.bytes, size);
      static_cast<void>(list ? out->Bytes(number, bytes) : out->Fixed(number, bytes));
      return;
    }
    default:
      for (const int64_t n : value.Integers()) out->Int(number, n);
  }
}

}  // namespace

void Proto::Varint(uint64_t value) {
  for (; value >= 0x80; value >>= 7) bytes_ += static_cast<char>(value | 0x80);
  bytes_ += static_cast<char>(value);
}

void Proto::Tag(int field, int wire_type) { Varint(static_cast<uint64_t>(field << 3 | wire_type)); }

Proto& Proto::Int(int field, int64_t value) {
  Tag(field, kVarint);
  Varint(static_cast<uint64_t>(value));
  return *this;
}

Proto& Proto::Double(int field, double value) {
  static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__, "protobuf's order");
  std::string bytes(sizeof value, '\0');
  std::memcpy(bytes.data(), &value, sizeof value);
  return Fixed(field, bytes);
}

Proto& Proto::Fixed(int field, const std::string& value) {
  Tag(field, value.size() == 8 ? kFixed64 : kFixed32);
  bytes_ += value;
  return *this;
}

Proto& Proto::Bytes(int field, const std::string& value) {
  Tag(field, kLengthDelimited);
  Varint(value.size());
  bytes_ += value;
  return *this;
}

std::string Descriptors(const Schema& schema, const Struct& type, const std::string& package) {
  std::set<std::string> names;
  Reach(schema, type, &names);
  Proto set, file;
  file.Bytes(1, package + "/" + type.name + ".proto").Bytes(2, package);
  for (const std::string& name : names) {
    const Struct& s = *schema.Find(name);
    if (!IsProtobufsOwn(name)) {
      file.Put(4, Message(s, package));
      continue;
    }
    const std::string own = "google/protobuf/" + name + ".proto";
    file.Bytes(3, own);
    set.Put(1, Proto()
                   .Bytes(1, own)
                   .Bytes(2, "google.protobuf")
                   .Put(4, Message(s, "google.protobuf"))
                   .Bytes(12, "proto3"));
  }
  return set.Put(1, file.Bytes(12, "proto3")).bytes();
}

Proto ToProto(const Schema& schema, const Struct& type, const Record& record) {
  Proto out;
  ForEachField(type, [&](int number, const Member& m) {
    PutValue(schema, number, record.values.at(m.name), &out);
  });
  return out;
}

}  // namespace chase::logs
