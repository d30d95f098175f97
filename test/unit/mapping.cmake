chase_test(mapping_test LIBS mapping_core octomap octomath SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/mapping_world.cpp
  ${CMAKE_CURRENT_LIST_DIR}/mapping_metrics.cpp
  ${CMAKE_CURRENT_LIST_DIR}/mapping_enclosing_test.cpp
  ${CMAKE_CURRENT_LIST_DIR}/mapping_grid_test.cpp
  ${CMAKE_CURRENT_LIST_DIR}/mapping_ray_walk_test.cpp
  ${CMAKE_CURRENT_LIST_DIR}/mapping_ground_test.cpp
  ${CMAKE_CURRENT_LIST_DIR}/mapping_body_test.cpp
  ${CMAKE_CURRENT_LIST_DIR}/mapping_tracker_test.cpp
  ${CMAKE_CURRENT_LIST_DIR}/mapping_tree_test.cpp
  ${CMAKE_CURRENT_LIST_DIR}/mapping_gym_test.cpp
  ${CMAKE_CURRENT_LIST_DIR}/mapping_target_test.cpp
  ${CMAKE_CURRENT_LIST_DIR}/mapping_mover_test.cpp)
chase_test(mapping_node_test LIBS mapping_node SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/mapping_world.cpp
  ${CMAKE_CURRENT_LIST_DIR}/mapping_node_test.cpp)
include(${CMAKE_CURRENT_LIST_DIR}/../mapping/mapping.cmake)
