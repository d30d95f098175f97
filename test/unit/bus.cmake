chase_test(config_test LIBS config SOURCES ${CMAKE_CURRENT_LIST_DIR}/config_test.cpp)
chase_test(bus_test LIBS bus SOURCES ${CMAKE_CURRENT_LIST_DIR}/bus_test.cpp ${CMAKE_CURRENT_LIST_DIR}/bus_default_url_test.cpp ${CMAKE_CURRENT_LIST_DIR}/bus_stage_clock_test.cpp)
chase_test(bus_hostile_test LIBS bus SOURCES ${CMAKE_CURRENT_LIST_DIR}/bus_hostile_test.cpp)
chase_test(bus_heard_order_test LIBS bus SOURCES ${CMAKE_CURRENT_LIST_DIR}/bus_heard_order_test.cpp)
chase_test(trajectory_test LIBS world SOURCES ${CMAKE_CURRENT_LIST_DIR}/trajectory_test.cpp)
chase_test(bus_lockstep_faults_test LIBS bus SOURCES ${CMAKE_CURRENT_LIST_DIR}/bus_lockstep_faults_test.cpp)

chase_program(bus_live_faults_test ${CMAKE_CURRENT_LIST_DIR}/bus_live_faults_test.cpp)
target_link_libraries(bus_live_faults_test PRIVATE bus scenario test_main)
set_target_properties(bus_live_faults_test PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/test)
add_test(NAME bus_live_faults
  COMMAND ${CMAKE_SOURCE_DIR}/test/flight/in_namespace.sh $<TARGET_FILE:bus_live_faults_test>
  WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
set_tests_properties(bus_live_faults PROPERTIES TIMEOUT 120 SKIP_RETURN_CODE 77)

# Steps of the host's wall clock: linked into a test, and preloaded into a live flight's processes.
chase_program(bus_clock_step_test ${CMAKE_CURRENT_LIST_DIR}/bus_clock_step_test.cpp ${CMAKE_SOURCE_DIR}/test/flight/wall_clock.cpp)
target_link_libraries(bus_clock_step_test PRIVATE bus test_main)
set_target_properties(bus_clock_step_test PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/test)
add_test(NAME bus_clock_step
  COMMAND ${CMAKE_SOURCE_DIR}/test/flight/in_namespace.sh $<TARGET_FILE:bus_clock_step_test>
  WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
set_tests_properties(bus_clock_step PROPERTIES TIMEOUT 120 SKIP_RETURN_CODE 77)

if(TARGET chase-prediction)
  chase_script_test(bus_loopback ${CMAKE_CURRENT_LIST_DIR}/bus_loopback_test.py ${CMAKE_BINARY_DIR}/bin
    BEFORE ${CMAKE_SOURCE_DIR}/test/flight/in_namespace.sh)
  set_tests_properties(bus_loopback PROPERTIES TIMEOUT 60)
endif()
