chase_benchmark(bench_perception LIBS perception_world
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/bench_perception.cpp)
