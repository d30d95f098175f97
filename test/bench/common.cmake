chase_benchmark(bench_separation
  LIBS separation
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/bench_separation.cpp)
