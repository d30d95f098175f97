chase_benchmark(bench_simulator LIBS simulator_core
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/bench_simulator.cpp)
target_compile_definitions(bench_simulator PRIVATE CHASE_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
