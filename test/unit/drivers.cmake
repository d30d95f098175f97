if(TARGET simulator_hardware)
  chase_test(simulator_px4_test LIBS simulator_hardware
    SOURCES ${CMAKE_CURRENT_LIST_DIR}/simulator_px4_test.cpp
            ${CMAKE_CURRENT_LIST_DIR}/simulator_px4_battery_test.cpp
            ${CMAKE_CURRENT_LIST_DIR}/simulator_px4_landing_test.cpp
            ${CMAKE_CURRENT_LIST_DIR}/simulator_udp_test.cpp)
endif()

# The simulator's devices and the drivers that read them.
if(TARGET simulator_hardware AND TARGET lidar_core AND TARGET camera_source)
  chase_test(drivers_test LIBS simulator_hardware scenario lidar_core camera_source
    SOURCES ${CMAKE_CURRENT_LIST_DIR}/drivers_test.cpp)
  target_compile_definitions(drivers_test PRIVATE CHASE_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  set_tests_properties(drivers_test PROPERTIES RUN_SERIAL TRUE)  # a TCP port
endif()

# The processes themselves, live.
if(TARGET chase-fcu AND TARGET chase-simulator AND TARGET chase-lidar AND TARGET chase-camera)
  chase_program(drivers_live_test ${CMAKE_SOURCE_DIR}/test/fcu/drivers_live_test.cpp)
  target_link_libraries(drivers_live_test PRIVATE mavlink bus math test_main)
  target_compile_definitions(drivers_live_test PRIVATE CHASE_BIN="${CMAKE_BINARY_DIR}/bin"
    CHASE_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  add_dependencies(drivers_live_test chase-fcu chase-simulator chase-lidar chase-camera)
  set_target_properties(drivers_live_test PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/test)
  add_test(NAME drivers_live
    COMMAND ${CMAKE_SOURCE_DIR}/test/flight/in_namespace.sh $<TARGET_FILE:drivers_live_test>
    WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
  set_tests_properties(drivers_live PROPERTIES TIMEOUT 300 RUN_SERIAL TRUE SKIP_RETURN_CODE 77)

  # For longer: test/flight/in_namespace.sh build/test/clouds_live_test 600.
  chase_program(clouds_live_test ${CMAKE_SOURCE_DIR}/test/fcu/clouds_live_test.cpp)
  target_link_libraries(clouds_live_test PRIVATE simulator_core scenario bus GTest::gtest)
  target_compile_definitions(clouds_live_test PRIVATE CHASE_BIN="${CMAKE_BINARY_DIR}/bin"
    CHASE_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
  add_dependencies(clouds_live_test chase-simulator chase-lidar)
  set_target_properties(clouds_live_test PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/test)
  add_test(NAME clouds_live
    COMMAND ${CMAKE_SOURCE_DIR}/test/flight/in_namespace.sh $<TARGET_FILE:clouds_live_test> 20
    WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
  add_test(NAME clouds_live_gps
    COMMAND ${CMAKE_SOURCE_DIR}/test/flight/in_namespace.sh $<TARGET_FILE:clouds_live_test> 10 gps
    WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
  set_tests_properties(clouds_live clouds_live_gps PROPERTIES TIMEOUT 120 RUN_SERIAL TRUE)
endif()
