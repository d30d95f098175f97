chase_test(logs_tools_test
  LIBS log_tools
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/logs_tools_test.cpp)
chase_test(logs_metrics_test
  LIBS metrics nlohmann_json::nlohmann_json
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/logs_metrics_test.cpp)
chase_test(logs_report_test
  LIBS report
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/logs_report_test.cpp)
