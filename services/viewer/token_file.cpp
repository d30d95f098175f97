#include "services/viewer/token_file.h"

#include <fstream>
#include <stdexcept>

#include "services/viewer/viewer_config.h"

namespace chase::viewer {

std::string TokenIn(const std::string& file) {
  std::ifstream in(file);
  std::string line;
  if (!in || !std::getline(in, line))
    throw std::runtime_error(file + ": no token can be read; cure: openssl rand -hex 16 > " + file);
  constexpr const char* kBlanks = " \t\r";
  const size_t first = line.find_first_not_of(kBlanks);
  ViewerConfig config;
  if (first != std::string::npos)
    config.token = line.substr(first, line.find_last_not_of(kBlanks) + 1 - first);
  if (config.token.empty()) throw std::runtime_error(file + ": its first line is empty");
  const std::string problem = config.Problem();
  if (!problem.empty()) throw std::runtime_error(file + ": " + problem);
  return config.token;
}

}  // namespace chase::viewer
