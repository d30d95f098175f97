#include "common/logs/record.h"

#include <cmath>
#include <cstring>

namespace chase::logs {
namespace {

constexpr int64_t kMaxElements = 1 << 26;  // of an array: more than a message of LCM's can carry

template <class To, class From>
To BitCast(From from) {
  static_assert(sizeof(To) == sizeof(From));
  To to;
  std::memcpy(&to, &from, sizeof to);
  return to;
}

uint64_t FromBigEndian(const std::string& bytes, size_t at, int size) {
  uint64_t value = 0;
  for (int i = 0; i < size; ++i)
    value = value << 8 | static_cast<uint8_t>(bytes[at + static_cast<size_t>(i)]);
  return value;
}

int64_t Signed(uint64_t value, int size) {
  return static_cast<int64_t>(value << (64 - 8 * size)) >> (64 - 8 * size);
}

double ToNumber(const std::string& type, uint64_t value, int size) {
  if (type == "double") return BitCast<double>(value);
  if (type == "float") return BitCast<float>(static_cast<uint32_t>(value));
  return type == "byte" ? static_cast<double>(value) : static_cast<double>(Signed(value, size));
}

std::string ToBytes(const std::string& type, double number) {
  const int size = PrimitiveSize(type);
  if (type == "double") return BigEndian(BitCast<uint64_t>(number), size);
  if (type == "float") return BigEndian(BitCast<uint32_t>(static_cast<float>(number)), size);
  const bool fits = std::abs(number) < 9.2e18;  // a cast of more, or of NaN, is undefined
  return BigEndian(static_cast<uint64_t>(fits ? static_cast<int64_t>(number) : 0), size);
}

class Reader {
 public:
  Reader(const Schema& schema, const std::string& bytes) : schema_(schema), bytes_(bytes) {}

  Record Read(const Struct& type) {
    Record record;
    for (const Member& m : type.members) {
      Value value = Read(m, record);
      record.values.emplace(m.name, std::move(value));
    }
    return record;
  }
  bool AtEnd() const { return at_ == bytes_.size(); }

 private:
  /// `before`: the members that stand before it, its lengths among them.
  Value Read(const Member& member, const Record& before) {
    Value value;
    value.member = &member;
    int64_t count = 1;
    for (const Dimension& d : member.dimensions) {
      value.extents.push_back(d.fixed ? std::stoll(d.text) : before.Find(d.text)->Integer());
      if (value.extents.back() < 0 || value.extents.back() > Left()) throw Malformed();
      count *= value.extents.back();
      if (count > Left()) throw Malformed();  // an element has a byte at least
    }
    ReadElements(count, &value);
    return value;
  }
  void ReadElements(int64_t count, Value* value) {
    const int size = PrimitiveSize(value->member->type);
    if (size > 0) value->bytes = Take(count * size);
    for (int64_t i = 0; size == 0 && i < count; ++i) value->bytes += TakeString();
    for (int64_t i = 0; size < 0 && i < count; ++i)
      value->records.push_back(Read(*schema_.Find(value->member->type)));
  }
  std::string TakeString() {
    const std::string length = Take(4);  // the zero at the end is counted
    const std::string text = Take(Signed(FromBigEndian(length, 0, 4), 4));
    if (text.empty() || text.back() != '\0') throw Malformed();
    return length + text;
  }
  std::string Take(int64_t count) {
    if (count < 0 || count > Left()) throw Malformed();
    const size_t begin = at_;
    at_ += static_cast<size_t>(count);
    return bytes_.substr(begin, static_cast<size_t>(count));
  }
  int64_t Left() const { return static_cast<int64_t>(bytes_.size() - at_); }

  const Schema& schema_;
  const std::string& bytes_;
  size_t at_ = 0;
};

}  // namespace

std::string BigEndian(uint64_t value, int size) {
  std::string bytes;
  for (int i = size - 1; i >= 0; --i) bytes += static_cast<char>(value >> (8 * i) & 0xFF);
  return bytes;
}

int64_t Value::Integer() const {
  const int size = PrimitiveSize(member->type);
  return Signed(FromBigEndian(bytes, 0, size), size);
}

std::vector<int64_t> Value::Integers() const {
  std::vector<int64_t> numbers;
  const int size = PrimitiveSize(member->type);
  for (size_t at = 0; size > 0 && at < bytes.size(); at += static_cast<size_t>(size))
    numbers.push_back(Signed(FromBigEndian(bytes, at, size), size));
  return numbers;
}

std::vector<double> Value::Numbers() const {
  std::vector<double> numbers;
  const int size = PrimitiveSize(member->type);
  for (size_t at = 0; size > 0 && at < bytes.size(); at += static_cast<size_t>(size))
    numbers.push_back(ToNumber(member->type, FromBigEndian(bytes, at, size), size));
  return numbers;
}

bool Value::Varies() const {
  return member->dimensions.size() == 1 && !member->dimensions[0].fixed;
}

void Value::SetNumbers(const std::vector<double>& numbers) {
  if (PrimitiveSize(member->type) <= 0) return;
  if (!Varies() && Numbers().size() != numbers.size()) return;
  if (Varies()) extents = {static_cast<int64_t>(numbers.size())};
  bytes.clear();
  for (const double number : numbers) bytes += ToBytes(member->type, number);
}

std::string Value::Text() const {
  return member->type == "string" && extents.empty() ? bytes.substr(4, bytes.size() - 5) : "";
}

void Value::SetText(const std::string& text) {
  if (member->type != "string" || !extents.empty()) return;
  bytes = BigEndian(text.size() + 1, 4) + text + '\0';
}

const Value* Record::Find(const std::string& member) const {
  const auto it = values.find(member);
  return it == values.end() ? nullptr : &it->second;
}

double Record::Number(const std::string& member) const {
  const Value* value = Find(member);
  const auto numbers = value ? value->Numbers() : std::vector<double>{};
  return numbers.empty() ? 0.0 : numbers[0];
}

void Record::Set(const std::string& member, const std::vector<double>& numbers) {
  const auto it = values.find(member);
  if (it == values.end()) return;
  it->second.SetNumbers(numbers);
  if (it->second.Varies())
    Set(it->second.member->dimensions[0].text, {static_cast<double>(numbers.size())});
}

Record Decode(const Schema& schema, const Struct& type, const std::string& bytes) {
  Reader reader(schema, bytes);
  Record record = reader.Read(type);
  if (!reader.AtEnd()) throw Malformed();
  return record;
}

std::string Encode(const Schema& schema, const Struct& type, const Record& record) {
  std::string bytes;
  for (const Member& m : type.members) {
    const Value& value = record.values.at(m.name);
    bytes += value.bytes;
    for (const Record& r : value.records) bytes += Encode(schema, *schema.Find(m.type), r);
  }
  return bytes;
}

Value Zero(const Schema& schema, const Member& member,
           const std::map<std::string, int64_t>& lengths) {
  Value value;
  value.member = &member;
  int64_t count = 1;
  for (const Dimension& d : member.dimensions) {
    const auto length = lengths.find(d.text);
    const int64_t varying = length == lengths.end() ? 0 : length->second;
    value.extents.push_back(d.fixed ? std::stoll(d.text) : varying);
    count *= value.extents.back();
    if (count > kMaxElements) throw Malformed();
  }
  const int size = PrimitiveSize(member.type);
  if (size > 0) value.bytes.assign(static_cast<size_t>(count * size), '\0');
  for (int64_t i = 0; size == 0 && i < count; ++i) value.bytes += BigEndian(1, 4) + '\0';
  if (size < 0)
    value.records.assign(static_cast<size_t>(count), Zero(schema, *schema.Find(member.type)));
  return value;
}

Record Zero(const Schema& schema, const Struct& type) {
  Record record;
  for (const Member& m : type.members) record.values.emplace(m.name, Zero(schema, m));
  return record;
}

}  // namespace chase::logs
