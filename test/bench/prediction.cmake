chase_benchmark(bench_prediction LIBS prediction_core SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/bench_prediction.cpp)
