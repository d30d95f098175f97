chase_test(lidar_test
  LIBS lidar_core lidar_source lidar_node
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/lidar_decoder_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/lidar_sweep_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/lidar_source_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/lidar_node_test.cpp ${CMAKE_SOURCE_DIR}/test/flight/wall_clock.cpp)
