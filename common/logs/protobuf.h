#pragma once

#include <cstdint>
#include <string>

#include "common/logs/record.h"
#include "common/logs/schema.h"

namespace chase::logs {

/// Builds a protobuf message (protobuf.dev, "Encoding"), field by field.
class Proto {
 public:
  Proto& Int(int field, int64_t value);
  Proto& Double(int field, double value);
  Proto& Bytes(int field, const std::string& value);
  Proto& Put(int field, const Proto& message) { return Bytes(field, message.bytes_); }
  /// Doubles or floats that are little endian already.
  Proto& Fixed(int field, const std::string& value);
  const std::string& bytes() const { return bytes_; }

 private:
  void Varint(uint64_t value);
  void Tag(int field, int wire_type);

  std::string bytes_;
};

/// A FileDescriptorSet that describes `type` and what it holds as protobuf messages: members keep
/// their names and are numbered from 1 in their order. A list's length is no member of its own;
/// bytes in a list become one `bytes`. Structs named Timestamp and Duration are protobuf's own.
std::string Descriptors(const Schema& schema, const Struct& type, const std::string& package);

/// `record` as the message that Descriptors describes.
Proto ToProto(const Schema& schema, const Struct& type, const Record& record);

}  // namespace chase::logs
