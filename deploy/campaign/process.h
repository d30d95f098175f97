#pragma once

#include <sys/types.h>

#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace chase::campaign {

/// A program and its arguments, for a shell.
std::string ShellLine(const std::vector<std::string>& command);

/// A running program whose stdout goes nowhere and whose stderr is kept in a file without a name.
/// It is told to end (SIGTERM) when this process dies. Throws std::runtime_error with one line.
class Process {
 public:
  explicit Process(const std::vector<std::string>& command);

  pid_t id() const { return id_; }
  /// How it ended, for people: its last line on stderr without its own name, else its exit code or
  /// signal.
  std::string Reason(int wait_status) const;

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  std::string LastLine() const;

  std::string name_;
  std::unique_ptr<std::FILE, Close> stderr_;
  pid_t id_ = -1;
};

/// Waits for one program to end; its status as waitpid gives it.
int Wait(const Process& process);

}  // namespace chase::campaign
