#include "logs/src/message_fields.h"

#include <map>
#include <type_traits>

#include "common/logs/message_types.h"

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

/// Of a list it visits one item, though there be none.
class PathCollector {
 public:
  template <class T>
  void operator()(const char* name, const T& value) {
    const std::string outer = path_;
    path_ += path_.empty() ? name : std::string(".") + name;
    Add(value);
    path_ = outer;
  }

  std::vector<std::string> Take() { return std::move(paths_); }

 private:
  template <class T>
  void Add(const T& value) {
    if constexpr (std::is_arithmetic_v<T> || std::is_same_v<T, std::string>)
      paths_.push_back(path_);
    else
      VisitFields(value, *this);
  }
  template <class T, size_t N>
  void Add(const T (&values)[N]) {
    Add(values[0]);
  }
  template <class T>
  void Add(const std::vector<T>&) {
    Add(T{});
  }

  std::string path_;
  std::vector<std::string> paths_;
};

template <class... T>
std::map<int64_t, std::string> Names(const std::tuple<T...>*) {
  return {{T::getHash(), T::getTypeName()}...};
}

}  // namespace

std::string TypeOf(const Bytes& message) {
  static const auto names = Names(static_cast<const MessageTypes*>(nullptr));
  const auto at = names.find(Fingerprint(message));
  return at == names.end() ? "" : at->second;
}

std::optional<std::vector<Field>> FieldsOf(const Bytes& bytes) {
  std::optional<std::vector<Field>> fields;
  WithMessage(bytes, [&](const auto& message) {
    Collector collector;
    VisitFields(message, collector);
    fields = collector.Take();
  });
  return fields;
}

std::vector<std::string> PathsOf(const Bytes& bytes) {
  PathCollector collector;
  WithMessage(bytes, [&](const auto& message) { VisitFields(message, collector); });
  return collector.Take();
}

}  // namespace chase::logs
