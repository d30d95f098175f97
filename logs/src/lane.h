#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace chase::logs {

/// Seconds under each name, and stretches of time with the same one.
class Lane {
 public:
  /// `by_reason`: a stretch ends where the words of its reason change, too; numbers may.
  explicit Lane(bool by_reason = false) : by_reason_(by_reason) {}
  /// From `t` [s] on, until the next name or a second at most. Times that go back count as none. A
  /// stretch has the reason that it began with.
  void Add(double t, const std::string& name, const std::string& reason = "");
  const std::map<std::string, double>& seconds() const { return seconds_; }
  /// Adds {lane, label, from, to} of every stretch, and its reason where it has one.
  void AddTo(const std::string& lane, nlohmann::ordered_json* spans) const;

 private:
  struct Span {
    std::string name, reason;
    double from, to;  // s
  };
  bool Continues(double t, const std::string& name, const std::string& reason) const;

  bool by_reason_;
  std::vector<Span> spans_;
  std::map<std::string, double> seconds_;
  double last_ = 0.0;
};

}  // namespace chase::logs
