chase_benchmark(bench_planning
  LIBS planning_core math_exact
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/bench_planning.cpp)
