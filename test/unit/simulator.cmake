chase_test(world_shapes_test LIBS world SOURCES ${CMAKE_CURRENT_LIST_DIR}/world_shapes_test.cpp)
chase_test(world_scenario_test LIBS scenario
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/world_scenario_test.cpp)
chase_test(simulator_test LIBS simulator_core
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/simulator_vehicle_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/simulator_lidar_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/simulator_camera_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/simulator_tile_bins_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/simulator_loop_test.cpp)
chase_test(simulator_facets_test LIBS simulator_core embree
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/simulator_facets_test.cpp)
chase_test(simulator_node_test LIBS simulator_node
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/simulator_node_test.cpp)

# An independent model of rays and rigid bodies.
find_library(MUJOCO_LIBRARY mujoco REQUIRED)
chase_test(simulator_mujoco_test LIBS simulator_core ${MUJOCO_LIBRARY}
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/simulator_mujoco_test.cpp)

foreach(name IN ITEMS world_scenario_test simulator_test simulator_node_test simulator_mujoco_test)
  target_compile_definitions(${name} PRIVATE CHASE_SOURCE_DIR="${CMAKE_SOURCE_DIR}")
endforeach()
