#include "logs/src/lane.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace chase::logs {
namespace {

constexpr double kLongestStep = 1.0;  // s that a message may stand for until the next one comes

double Rounded(double t) { return std::round(t * 1e3) / 1e3; }

std::string WithoutNumbers(std::string text) {
  const auto numeric = [](char c) { return std::strchr("0123456789.+-", c) != nullptr; };
  text.erase(std::remove_if(text.begin(), text.end(), numeric), text.end());
  return text;
}

}  // namespace

void Lane::Add(double t, const std::string& name, const std::string& reason) {
  if (!spans_.empty()) {
    const double step = std::clamp(t - last_, 0.0, kLongestStep);
    seconds_[spans_.back().name] += step;
    spans_.back().to = last_ + step;
  }
  if (!Continues(t, name, reason)) spans_.push_back({name, reason, t, t});
  last_ = t;
}

bool Lane::Continues(double t, const std::string& name, const std::string& reason) const {
  if (spans_.empty() || spans_.back().name != name || t - last_ > kLongestStep) return false;
  return !by_reason_ || WithoutNumbers(spans_.back().reason) == WithoutNumbers(reason);
}

void Lane::AddTo(const std::string& lane, nlohmann::ordered_json* spans) const {
  for (const Span& s : spans_) {
    spans->push_back(
        {{"lane", lane}, {"label", s.name}, {"from", Rounded(s.from)}, {"to", Rounded(s.to)}});
    if (!s.reason.empty()) spans->back()["reason"] = s.reason;
  }
}

}  // namespace chase::logs
