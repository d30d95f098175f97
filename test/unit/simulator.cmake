chase_test(world_shapes_test LIBS world SOURCES ${CMAKE_CURRENT_LIST_DIR}/world_shapes_test.cpp)
chase_test(world_scenario_test LIBS scenario
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/world_scenario_test.cpp)
target_compile_definitions(world_scenario_test PRIVATE CHASE_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
chase_test(simulator_test LIBS simulator_core
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/simulator_vehicle_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/simulator_lidar_test.cpp)
target_compile_definitions(simulator_test PRIVATE CHASE_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
