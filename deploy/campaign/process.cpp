#include "deploy/campaign/process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <filesystem>
#include <stdexcept>

namespace chase::campaign {
namespace {

std::string Quoted(const std::string& text) {
  if (!text.empty() &&
      text.find_first_not_of("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"
                             "_-./:,=+@") == std::string::npos)
    return text;
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

[[noreturn]] void Become(std::vector<std::string> words, std::FILE* err, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) _exit(127);  // it died before the line above
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  dup2(open("/dev/null", O_WRONLY), STDOUT_FILENO);
  dup2(fileno(err), STDERR_FILENO);
  execv(argv[0], argv.data());
  dprintf(STDERR_FILENO, "%s cannot be started; check the path and its rights\n", argv[0]);
  _exit(127);
}

}  // namespace

std::string ShellLine(const std::vector<std::string>& command) {
  std::string line;
  for (const std::string& word : command) line += (line.empty() ? "" : " ") + Quoted(word);
  return line;
}

Process::Process(const std::vector<std::string>& command)
    : name_(std::filesystem::path(command.front()).filename()), stderr_(std::tmpfile()) {
  if (!stderr_) throw std::runtime_error("no file for a flight's messages; is the disk full?");
  const pid_t parent = getpid();
  id_ = fork();
  if (id_ < 0)
    throw std::runtime_error(name_ + ": no process for it; fewer --jobs, or a higher ulimit -u");
  if (id_ == 0) Become(command, stderr_.get(), parent);
}

std::string Process::LastLine() const {
  std::rewind(stderr_.get());
  std::string text;
  for (int c = 0; (c = std::fgetc(stderr_.get())) != EOF;) text += static_cast<char>(c);
  text.erase(text.find_last_not_of(" \r\n") + 1);
  text.erase(0, text.find_last_of("\r\n") + 1);
  const std::string start = name_ + ": ";
  return text.rfind(start, 0) == 0 ? text.substr(start.size()) : text;
}

std::string Process::Reason(int wait_status) const {
  if (WIFSIGNALED(wait_status)) return fmt::format("ended by signal {}", WTERMSIG(wait_status));
  const std::string line = LastLine();
  return line.empty() ? fmt::format("exit code {}", WEXITSTATUS(wait_status)) : line;
}

int Wait(const Process& process) {
  int status = 0;
  while (waitpid(process.id(), &status, 0) < 0)
    if (errno != EINTR) throw std::runtime_error("a flight's process is lost; run again to go on");
  return status;
}

}  // namespace chase::campaign
