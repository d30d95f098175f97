chase_test(config_test LIBS config SOURCES ${CMAKE_CURRENT_LIST_DIR}/config_test.cpp)
chase_test(bus_test LIBS bus SOURCES ${CMAKE_CURRENT_LIST_DIR}/bus_test.cpp)
chase_test(bus_hostile_test LIBS bus SOURCES ${CMAKE_CURRENT_LIST_DIR}/bus_hostile_test.cpp)
chase_test(bus_heard_order_test LIBS bus SOURCES ${CMAKE_CURRENT_LIST_DIR}/bus_heard_order_test.cpp)
chase_test(trajectory_test LIBS world SOURCES ${CMAKE_CURRENT_LIST_DIR}/trajectory_test.cpp)
chase_test(bus_lockstep_faults_test LIBS bus SOURCES ${CMAKE_CURRENT_LIST_DIR}/bus_lockstep_faults_test.cpp)

if(TARGET chase-prediction)
  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  add_test(NAME bus_loopback
    COMMAND ${CMAKE_SOURCE_DIR}/test/flight/in_namespace.sh
            ${Python3_EXECUTABLE} -B ${CMAKE_CURRENT_LIST_DIR}/bus_loopback_test.py ${CMAKE_BINARY_DIR}/bin)
  set_tests_properties(bus_loopback PROPERTIES TIMEOUT 60)
endif()
