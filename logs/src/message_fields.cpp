#include "logs/src/message_fields.h"

#include <map>
#include <type_traits>

#include "logs/src/field_tables.h"

namespace chase::logs {
namespace {

class Collector {
 public:
  template <class T>
  void operator()(const char* name, const T& value) {
    const std::string outer = path_;
    path_ += path_.empty() ? name : std::string(".") + name;
    Add(value);
    path_ = outer;
  }

  std::vector<Field> Take() { return std::move(fields_); }

 private:
  template <class T>
  void Add(const T& value) {
    if constexpr (std::is_arithmetic_v<T>)
      Here()->numbers.push_back(static_cast<double>(value));
    else
      VisitFields(value, *this);
  }
  void Add(const std::string& value) { Here()->texts.push_back(value); }
  template <class T, size_t N>
  void Add(const T (&values)[N]) {
    for (const T& value : values) Add(value);
  }
  template <class T>
  void Add(const std::vector<T>& values) {
    const bool outer = in_list_;
    in_list_ = true;
    if constexpr (std::is_arithmetic_v<T>)
      Here()->numbers.insert(Here()->numbers.end(), values.begin(), values.end());
    else
      for (const T& value : values) Add(value);
    in_list_ = outer;
  }

  Field* Here() {
    const auto [at, fresh] = index_.emplace(path_, fields_.size());
    if (fresh) fields_.push_back({path_, {}, {}, in_list_});
    return &fields_[at->second];
  }

  std::string path_;
  bool in_list_ = false;
  std::vector<Field> fields_;
  std::map<std::string, size_t> index_;
};

template <class T>
std::optional<std::vector<Field>> DecodeFields(const Bytes& bytes) {
  T message;
  try {
    const auto size = static_cast<int>(bytes.size());
    if (message.decode(bytes.data(), 0, size) != size) return std::nullopt;
  } catch (const std::exception&) {  // generated decoders throw on negative lengths
    return std::nullopt;
  }
  Collector collector;
  VisitFields(message, collector);
  return collector.Take();
}

struct Type {
  std::string name;
  std::optional<std::vector<Field>> (*decode)(const Bytes&);
};

template <class... T>
std::map<int64_t, Type> MakeTable() {
  return {{T::getHash(), Type{T::getTypeName(), &DecodeFields<T>}}...};
}

const Type* Find(const Bytes& bytes) {
  static const auto table = MakeTable<attitude_setpoint_t, camera_image_t, imu_t, lidar_scan_t,
                                      map_t, obstacles_t, plan_t, pose_t, prediction_t,
                                      scan_registered_t, scenario_t, status_t, target_t, truth_t>();
  if (bytes.size() < 8) return nullptr;
  uint64_t fingerprint = 0;
  for (size_t i = 0; i < 8; ++i) fingerprint = fingerprint << 8 | bytes[i];
  const auto at = table.find(static_cast<int64_t>(fingerprint));
  return at == table.end() ? nullptr : &at->second;
}

}  // namespace

std::string TypeOf(const Bytes& message) {
  const Type* type = Find(message);
  return type ? type->name : "";
}

std::optional<std::vector<Field>> FieldsOf(const Bytes& message) {
  const Type* type = Find(message);
  return type ? type->decode(message) : std::nullopt;
}

}  // namespace chase::logs
