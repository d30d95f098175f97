chase_test(camera_test
  LIBS camera_core camera_source
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/camera_test.cpp)
