#pragma once

#include <Eigen/Core>
#include <cmath>
#include <string>
#include <vector>

#include "common/config/config.h"

namespace chase::worlds {

/// Rounds every number of a config to so many decimals, so that its file is short and holds exactly
/// what was drawn.
class Rounding {
 public:
  explicit Rounding(int decimals) : scale_(std::pow(10.0, decimals)) {}

  template <class T>
  void operator()(const char* /*name*/, T& field, const char* /*doc*/) {
    Round(field);
  }
  template <class T>
  void Round(T& field) {
    if constexpr (config::detail::IsConfig<T>::value) field.Visit(*this);
  }
  template <class T>
  void Round(std::vector<T>& list) {
    for (auto& item : list) Round(item);
  }
  template <int N>
  void Round(Eigen::Matrix<double, N, 1>& v) {
    for (int i = 0; i < N; ++i) Round(v[i]);
  }
  void Round(double& value) { value = std::round(value * scale_) / scale_ + 0.0; }  // no -0

 private:
  double scale_;
};

template <class C>
C Rounded(C config, int decimals) {
  Rounding rounding(decimals);
  config.Visit(rounding);
  return config;
}

}  // namespace chase::worlds
