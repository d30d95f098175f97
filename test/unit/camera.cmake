chase_test(camera_test
  LIBS camera_core camera_source camera_node
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/camera_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/camera_stream_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/camera_node_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/camera_clock_step_test.cpp
          ${CMAKE_SOURCE_DIR}/test/flight/wall_clock.cpp)
