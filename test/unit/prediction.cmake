chase_test(prediction_search_test LIBS prediction_core SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/prediction_search_test.cpp)
