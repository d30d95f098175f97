#include "logs/src/gnuplot.h"

#include <sys/wait.h>

#include <cstdio>
#include <filesystem>
#include <stdexcept>

namespace chase::logs {
namespace {

void RunGnuplot(const std::string& script) {
  constexpr int kNotFound = 127;  // the shell's
  FILE* pipe = popen("gnuplot", "w");
  if (!pipe) throw std::runtime_error("gnuplot: cannot be started");
  const bool written = std::fwrite(script.data(), 1, script.size(), pipe) == script.size();
  const int status = pclose(pipe);
  if (WIFEXITED(status) && WEXITSTATUS(status) == kNotFound)
    throw std::runtime_error("gnuplot: not found; install it with apt-get install gnuplot-nox");
  if (!written || status != 0) throw std::runtime_error("gnuplot: refused a script, see above");
}

}  // namespace

std::string GnuplotString(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("''") : std::string(1, c);
  return out + "'";
}

void DrawPng(const std::string& file,
             const std::function<std::string(const std::string&)>& script) {
  const std::filesystem::path path(file);
  const std::string temporary =
      (path.parent_path() / ("." + path.filename().string() + ".tmp")).string();
  try {
    RunGnuplot(script(temporary) + "unset output\n");
  } catch (...) {
    std::filesystem::remove(temporary);
    throw;
  }
  std::filesystem::rename(temporary, path);
}

}  // namespace chase::logs
