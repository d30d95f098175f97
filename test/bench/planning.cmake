chase_benchmark(bench_planning
  LIBS planning_core math_exact
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/bench_planning.cpp ${CMAKE_CURRENT_LIST_DIR}/literal_planner.cpp)
if(TARGET prediction_core)
  target_sources(bench_planning PRIVATE ${CMAKE_CURRENT_LIST_DIR}/prediction_rows.cpp)
  target_link_libraries(bench_planning PRIVATE prediction_core)
endif()
