chase_benchmark(bench_mapping LIBS mapping_core octomap octomath SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/bench_mapping.cpp
  ${CMAKE_CURRENT_LIST_DIR}/../unit/mapping_world.cpp
  ${CMAKE_CURRENT_LIST_DIR}/../unit/mapping_metrics.cpp)
target_include_directories(bench_mapping PRIVATE ${CMAKE_CURRENT_LIST_DIR}/../unit)
