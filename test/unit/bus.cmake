chase_test(config_test LIBS config SOURCES ${CMAKE_CURRENT_LIST_DIR}/config_test.cpp)
chase_test(bus_test LIBS bus SOURCES ${CMAKE_CURRENT_LIST_DIR}/bus_test.cpp)
chase_test(bus_hostile_test LIBS bus SOURCES ${CMAKE_CURRENT_LIST_DIR}/bus_hostile_test.cpp)
chase_test(trajectory_test LIBS world SOURCES ${CMAKE_CURRENT_LIST_DIR}/trajectory_test.cpp)
