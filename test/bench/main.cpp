#include <benchmark/benchmark.h>

#include <iostream>
#include <string_view>

#include "common/config/version.h"

/// Google Benchmark's main, with every program's --version; the figures name the commit, too.
int main(int argc, char** argv) {
  const std::string version = chase::config::Version();
  if (argc == 2 && argv[1] == std::string_view("--version")) {
    std::cout << version << '\n';
    return 0;
  }
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::AddCustomContext("version", version);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
