chase_test(planning_search_test
  LIBS planning_core math_exact
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/planning_search_test.cpp)
