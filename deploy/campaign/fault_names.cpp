#include "deploy/campaign/fault_names.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <stdexcept>

namespace chase::campaign {
namespace {

std::vector<std::string> MakeNames() {
  std::vector<std::string> names;
  for (const char* process :
       {"odometry", "mapping", "perception", "prediction", "planning", "control"}) {
    names.push_back(std::string("kill-") + process);
    names.push_back(std::string("freeze-") + process);
  }
  names.insert(names.end(), {"lidar-gap", "lidar-dead"});
  return names;
}

bool IsTime(const std::string& text) {
  double time = -1.0;
  const char* end = text.data() + text.size();
  const auto [at, error] = std::from_chars(text.data(), end, time, std::chars_format::fixed);
  return error == std::errc() && at == end && time >= 0.0 && time < 1e6;
}

}  // namespace

const std::vector<std::string>& FaultNames() {
  static const std::vector<std::string> names = MakeNames();
  return names;
}

void CheckFault(const std::string& fault) {
  const auto& names = FaultNames();
  const size_t sign = fault.find('@');
  if (std::find(names.begin(), names.end(), fault.substr(0, sign)) == names.end())
    throw std::runtime_error(fmt::format("no fault '{}'; use none, all or {}",
                                         fault.substr(0, sign), fmt::join(names, ", ")));
  if (sign != std::string::npos && !IsTime(fault.substr(sign + 1)))
    throw std::runtime_error(
        fmt::format("fault '{}': '{}' is no mission time, 0 s or more; use NAME or NAME@SECONDS",
                    fault, fault.substr(sign + 1)));
}

}  // namespace chase::campaign
