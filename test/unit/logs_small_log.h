#pragma once

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>

#include "chase/imu_t.hpp"
#include "chase/obstacles_t.hpp"
#include "common/logs/message_types.h"
#include "logs/src/output.h"

/// Small logs, and files of a test's own, for the tests of the tools that read logs.
namespace chase::logs::testing {

namespace fs = std::filesystem;

inline std::string Temp(const std::string& name) {
  const fs::path file = fs::path(::testing::TempDir()) / ("chase_logs_" + name);
  fs::remove_all(file);
  return file.string();
}

inline std::string WriteText(const std::string& name, const std::string& text) {
  const std::string file = Temp(name);
  std::ofstream(file, std::ios::binary) << text;
  return file;
}

inline std::string ReadText(const std::string& file) {
  std::ifstream in(file, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

inline std::string ErrorOf(const std::function<void()>& call) {
  try {
    call();
  } catch (const std::runtime_error& e) {
    return e.what();
  }
  return "";
}

inline imu_t Imu(int k) {
  imu_t m{};
  m.utime = 5000 * k;
  m.seq = k;
  m.accel[2] = 9.81;
  m.gyro[0] = 0.1 * k;
  return m;
}

inline obstacles_t Obstacles(int count) {
  obstacles_t m{};
  m.n_obstacles = count;
  for (int i = 0; i < count; ++i) {
    obstacle_t o{};
    o.id = 10 + i;
    o.center.duration = 1.0;
    o.center.n_coefficients = 3;
    o.center.coefficients = {1.0 * i, 2.0, 3.0};
    m.obstacles.push_back(o);
  }
  return m;
}

/// 20 IMU samples, one of them changed by `change`, and a few obstacle lists.
inline std::string WriteLog(const std::string& name,
                            const std::function<void(int, imu_t*)>& change = {}, int imus = 20) {
  const std::string file = Temp(name);
  OutputLog log(file);
  for (int k = 0; k < imus; ++k) {
    imu_t m = Imu(k);
    if (change) change(k, &m);
    log.Write(m.utime, "IMU", m);
    if (k % 5 == 0) log.Write(m.utime, "OBSTACLES", Obstacles(k / 5));
  }
  log.Close();
  return file;
}

template <class T>
Bytes Encoded(const T& m) {
  Bytes bytes(static_cast<size_t>(m.getEncodedSize()));
  m.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

}  // namespace chase::logs::testing
