chase_test(viewer_core_test
  LIBS viewer_core nlohmann_json::nlohmann_json
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/viewer_core_test.cpp)
