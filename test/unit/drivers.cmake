# The simulator's devices and the drivers that read them.
if(TARGET simulator_hardware AND TARGET lidar_core AND TARGET camera_source)
  chase_test(drivers_test LIBS simulator_hardware scenario lidar_core camera_source
    SOURCES ${CMAKE_CURRENT_LIST_DIR}/drivers_test.cpp)
  target_compile_definitions(drivers_test PRIVATE CHASE_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  set_tests_properties(drivers_test PROPERTIES RUN_SERIAL TRUE)  # a TCP port
endif()
