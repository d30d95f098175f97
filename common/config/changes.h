#pragma once

#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "common/config/config.h"

namespace chase::config {

namespace detail {

inline constexpr std::size_t kLineWidth = 100;

/// Addresses of a config's fields in the order of its Visit.
struct FieldAddresses {
  std::vector<void*> fields;
  template <class T>
  void operator()(const char* /*name*/, T& field, const char* /*doc*/) {
    fields.push_back(&field);
  }
};

/// A value in YAML's flow style, on one line.
class FlowText {
 public:
  template <class T>
  static std::string Of(T& value) {
    if constexpr (IsConfig<T>::value) {
      return OfConfig(value);
    } else {
      return OfPlain(value);
    }
  }
  template <class T>
  static std::string Of(std::vector<T>& values) {
    std::string text;
    for (auto& value : values) text += (text.empty() ? "" : ", ") + Of(value);
    return "[" + text + "]";
  }

 private:
  template <class C>
  static std::string OfConfig(C& config);
  static std::string OfPlain(bool v) { return v ? "true" : "false"; }
  static std::string OfPlain(int v) { return std::to_string(v); }
  static std::string OfPlain(int64_t v) { return std::to_string(v); }
  static std::string OfPlain(double v) { return FormatNumber(v); }
  static std::string OfPlain(const std::string& v) { return Quoted(v); }
  template <int N>
  static std::string OfPlain(const Eigen::Matrix<double, N, 1>& v) {
    std::string text;
    for (int i = 0; i < N; ++i) text += (i ? ", " : "") + FormatNumber(v[i]);
    return "[" + text + "]";
  }
};

/// Calls write(name, field) for each field of `config` whose value differs from that in `base`.
template <class C, class Write>
void ForEachChange(C& config, C& base, const Write& write);

/// Lines "key: value" of what differs from `base`, indented.
class ChangesWriter {
 public:
  explicit ChangesWriter(int indent) : pad_(static_cast<std::size_t>(indent), ' ') {}

  template <class C>
  std::string Text(C& config, C& base) {
    ForEachChange(config, base, [&](const std::string& name, auto& field, auto& original) {
      text_ += pad_ + name + ":" + Value(field, original, name.size() + 2);
    });
    return text_;
  }

 private:
  int deeper() const { return static_cast<int>(pad_.size()) + 2; }

  template <class T>
  std::string Value(T& field, T& base, std::size_t used) const {
    if constexpr (IsConfig<T>::value) {
      return "\n" + ChangesWriter(deeper()).Text(field, base);
    } else if constexpr (std::is_same_v<T, std::string>) {
      return field.find('\n') == field.npos ? " " + Quoted(field) + "\n" : Block(field);
    } else {
      return " " + Wrapped(FlowText::Of(field), used);
    }
  }
  /// A list of configs has a line for each, or a block where that would be too long.
  template <class T>
  std::string Value(std::vector<T>& field, std::vector<T>& /*base*/, std::size_t used) const {
    if (!IsConfig<T>::value || field.empty()) return " " + Wrapped(FlowText::Of(field), used);
    std::string text = "\n";
    for (auto& item : field) text += Item(item);
    return text;
  }
  template <class T>
  std::string Item(T& item) const {
    const std::string line = pad_ + "  - " + FlowText::Of(item);
    if (line.size() <= kLineWidth && line.find("\\n") == line.npos) return line + "\n";
    if constexpr (IsConfig<T>::value) {
      T base{};
      std::string text = ChangesWriter(deeper() + 2).Text(item, base);
      return text.replace(0, pad_.size() + 4, pad_ + "  - ");
    }
    return line + "\n";
  }
  std::string Block(const std::string& lines) const;
  std::string Wrapped(const std::string& flow, std::size_t used) const;

  std::string pad_, text_;
};

template <class C>
struct ChangeVisitor {
  std::vector<void*> base;
  C write;
  std::size_t i = 0;
  template <class T>
  void operator()(const char* name, T& field, const char* /*doc*/) {
    T& original = *static_cast<T*>(base[i++]);
    if (FlowText::Of(field) != FlowText::Of(original)) write(std::string(name), field, original);
  }
};

template <class C, class Write>
void ForEachChange(C& config, C& base, const Write& write) {
  FieldAddresses addresses;
  base.Visit(addresses);
  ChangeVisitor<const Write&> visitor{addresses.fields, write};
  config.Visit(visitor);
}

template <class C>
std::string FlowText::OfConfig(C& config) {
  C base{};
  std::string text;
  ForEachChange(config, base, [&](const std::string& name, auto& field, auto&) {
    text += (text.empty() ? "" : ", ") + name + ": " + Of(field);
  });
  return "{" + text + "}";
}

}  // namespace detail

/// What differs from `base` as compact YAML without comments: a list's items on a line each where
/// they fit. Loaded over `base`, the text gives the config's values again.
template <class C>
std::string DumpChanges(C config, C base = {}) {
  return detail::ChangesWriter(0).Text(config, base);
}

}  // namespace chase::config
