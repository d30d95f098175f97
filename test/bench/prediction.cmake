chase_benchmark(bench_prediction LIBS prediction_core scenario worlds SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/bench_prediction.cpp ${CMAKE_CURRENT_LIST_DIR}/prediction_rows.cpp
  ${CMAKE_CURRENT_LIST_DIR}/prediction_courses.cpp)
target_compile_definitions(bench_prediction PRIVATE CHASE_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
