#pragma once

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>
#include <sstream>
#include <string>

namespace chase::testing {

/// A program with a config of these lines, and flags.
class Process {
 public:
  explicit Process(const char* program, const std::string& config, const char* flag = nullptr) {
    static int number = 0;
    const std::string base =
        ::testing::TempDir() + "live_" + std::to_string(getpid()) + "_" + std::to_string(++number);
    std::ofstream(base + ".yaml") << config;
    errors_ = base + ".err";
    pid_ = fork();
    if (pid_ != 0) return;
    const int err = open(errors_.c_str(), O_CREAT | O_WRONLY | O_TRUNC, 0644);
    dup2(err, 2);
    execl(program, program, "--config", (base + ".yaml").c_str(), flag, nullptr);
    _exit(127);
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process() { End(SIGINT); }

  /// Its exit code; `signal` 0: it ends by itself.
  int End(int signal) {
    if (pid_ <= 0) return code_;
    if (signal != 0) kill(pid_, signal);
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = 0;
    return code_ = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  std::string errors() const {
    std::ifstream in(errors_);
    std::ostringstream text;
    text << in.rdbuf();
    return text.str();
  }

 private:
  pid_t pid_ = 0;
  int code_ = -1;
  std::string errors_;
};

}  // namespace chase::testing
