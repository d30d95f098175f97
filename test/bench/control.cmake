if(TARGET planning_core)
  chase_benchmark(bench_control LIBS control_core planning_core
    SOURCES ${CMAKE_CURRENT_LIST_DIR}/bench_control.cpp)
endif()
