#pragma once

#include <yaml-cpp/yaml.h>

#include <Eigen/Core>
#include <fstream>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string>
#include <type_traits>
#include <vector>

/// A config is a struct with defaults and two members:
///   template <class V> void Visit(V& v) { v("horizon", horizon, "length of the plan, s"); ... }
///   std::string Problem() const;   // optional: names the field, its value and the limit; or empty
/// Loading, dumping and listing all go through Visit, so that a parameter is spelled once.
/// Fields: bool, int, int64_t, double, std::string, fixed Eigen vectors, nested configs, and
/// std::vector of any of these.
namespace chase::config {

namespace detail {

template <class T, class = void>
struct HasProblem : std::false_type {};
template <class T>
struct HasProblem<T, std::void_t<decltype(std::declval<const T&>().Problem())>> : std::true_type {};

struct AnyVisitor {
  template <class T>
  void operator()(const char*, T&, const char*) {}
};
template <class T, class = void>
struct IsConfig : std::false_type {};
template <class T>
struct IsConfig<T, std::void_t<decltype(std::declval<T&>().Visit(std::declval<AnyVisitor&>()))>>
    : std::true_type {};

/// "file:line: what" as one exception.
[[noreturn]] void Fail(const std::string& origin, const YAML::Node& node, const std::string& what);
/// The node under `node` of the field that a sentence of Problem() begins with, such as
/// "grid.range is 0", "lidar: rate is 0" or "walls[2]: height is 0", as deep as the file has it.
YAML::Node NamedBy(const std::string& problem, const YAML::Node& node);
std::string TypeName(const bool*);
std::string TypeName(const int*);
std::string TypeName(const int64_t*);
std::string TypeName(const double*);
std::string TypeName(const std::string*);
std::string FormatNumber(double value);
std::string Quoted(const std::string& text);

template <class C>
void CheckProblem(const std::string& origin, const YAML::Node& node, const std::string& path,
                  const C& config) {
  if constexpr (HasProblem<C>::value) {
    const std::string problem = config.Problem();
    if (!problem.empty())
      Fail(origin, NamedBy(problem, node), path.empty() ? problem : path + ": " + problem);
  }
}

class Reader {
 public:
  Reader(std::string origin, const YAML::Node& node, std::string path)
      : origin_(std::move(origin)), node_(node), path_(std::move(path)) {}

  template <class T>
  void operator()(const char* name, T& field, const char* /*doc*/) {
    known_.insert(name);
    const YAML::Node child = node_[name];
    if (child.IsDefined()) Read(child, path_.empty() ? name : path_ + "." + name, &field);
  }

  void RefuseWrongKeys() const;

  template <class C>
  static void ReadConfig(const std::string& origin, const YAML::Node& node, const std::string& path,
                         C* config) {
    if (node.IsNull()) return CheckProblem(origin, node, path, *config);
    if (!node.IsMap()) Fail(origin, node, path + ": expected a map of keys and values");
    Reader reader(origin, node, path);
    config->Visit(reader);
    reader.RefuseWrongKeys();
    CheckProblem(origin, node, path, *config);
  }

 private:
  template <class T>
  void Read(const YAML::Node& node, const std::string& path, T* field) const {
    if constexpr (IsConfig<T>::value)
      ReadConfig(origin_, node, path, field);
    else
      ReadScalar(node, path, field);
  }
  template <class T>
  void ReadScalar(const YAML::Node& node, const std::string& path, T* field) const {
    if (!node.IsScalar()) Fail(origin_, node, path + ": expected " + TypeName(field));
    try {
      *field = node.as<T>();
    } catch (const YAML::Exception&) {
      Fail(origin_, node, path + ": '" + node.Scalar() + "' is not " + TypeName(field));
    }
  }
  template <class T>
  void Read(const YAML::Node& node, const std::string& path, std::vector<T>* field) const {
    if (!node.IsSequence()) Fail(origin_, node, path + ": expected a list");
    field->clear();
    for (std::size_t i = 0; i < node.size(); ++i) {
      T item{};
      Read(node[i], path + "[" + std::to_string(i) + "]", &item);
      field->push_back(std::move(item));
    }
  }
  template <int N>
  void Read(const YAML::Node& node, const std::string& path,
            Eigen::Matrix<double, N, 1>* field) const {
    if (!node.IsSequence() || node.size() != static_cast<std::size_t>(N))
      Fail(origin_, node, path + ": expected a list of " + std::to_string(N) + " numbers");
    for (int i = 0; i < N; ++i) {
      double value = 0.0;
      ReadScalar(node[static_cast<std::size_t>(i)], path + "[" + std::to_string(i) + "]", &value);
      (*field)[i] = value;
    }
  }

  std::string origin_;
  YAML::Node node_;
  std::string path_;
  std::set<std::string> known_;
};

class Writer {
 public:
  explicit Writer(int indent) : indent_(indent) {}

  template <class T>
  void operator()(const char* name, T& field, const char* doc) {
    out_ << std::string(static_cast<std::size_t>(indent_), ' ') << name << ":";
    Write(field, doc);
  }
  std::string text() const { return out_.str(); }

 private:
  void Comment(const char* doc) { out_ << (doc && *doc ? std::string("  # ") + doc : "") << "\n"; }

  template <class T>
  void Write(T& field, const char* doc) {
    if constexpr (IsConfig<T>::value) {
      Comment(doc);
      Writer inner(indent_ + 2);
      field.Visit(inner);
      out_ << inner.text();
    } else {
      out_ << " " << Scalar(field);
      Comment(doc);
    }
  }
  template <class T>
  void Write(std::vector<T>& field, const char* doc) {
    if constexpr (IsConfig<T>::value) {
      WriteList(field, doc);
    } else {
      out_ << " [";
      for (std::size_t i = 0; i < field.size(); ++i) out_ << (i ? ", " : "") << Scalar(field[i]);
      out_ << "]";
      Comment(doc);
    }
  }
  template <class T>
  void WriteList(std::vector<T>& field, const char* doc) {
    if (field.empty()) out_ << " []";
    Comment(doc);
    const std::string pad(static_cast<std::size_t>(indent_) + 2, ' ');
    for (auto& item : field) {
      Writer inner(indent_ + 4);
      item.Visit(inner);
      std::string text = inner.text();
      if (text.size() > pad.size()) text.replace(0, pad.size() + 2, pad + "- ");
      out_ << text;
    }
  }

  static std::string Scalar(bool v) { return v ? "true" : "false"; }
  static std::string Scalar(int v) { return std::to_string(v); }
  static std::string Scalar(int64_t v) { return std::to_string(v); }
  static std::string Scalar(double v) { return FormatNumber(v); }
  static std::string Scalar(const std::string& v) { return Quoted(v); }
  template <int N>
  static std::string Scalar(const Eigen::Matrix<double, N, 1>& v) {
    std::string text = "[";
    for (int i = 0; i < N; ++i) text += (i ? ", " : "") + FormatNumber(v[i]);
    return text + "]";
  }

  int indent_;
  std::ostringstream out_;
};

YAML::Node ParseFile(const std::string& file);
YAML::Node ParseText(const std::string& text, const std::string& origin);

}  // namespace detail

/// Overrides fields of `config` by the keys of a YAML file. Throws std::runtime_error with one line
/// "file:line: field: what is wrong" on a missing file, an unknown key, a key given twice, a wrong
/// type or a value that Problem() refuses; `config` is then in an unspecified state.
template <class C>
void Load(const std::string& file, C* config) {
  detail::Reader::ReadConfig(file, detail::ParseFile(file), "", config);
}

/// The same from text; `origin` stands for the file in errors.
template <class C>
void LoadText(const std::string& text, const std::string& origin, C* config) {
  detail::Reader::ReadConfig(origin, detail::ParseText(text, origin), "", config);
}

/// The complete config as YAML with one comment per field; Load reads it back to the same values.
template <class C>
std::string Dump(C config) {
  detail::Writer writer(0);
  config.Visit(writer);
  return writer.text();
}

}  // namespace chase::config
