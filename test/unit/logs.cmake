chase_test(logs_tools_test
  LIBS log_tools
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/logs_tools_test.cpp)
chase_test(logs_scene_test
  LIBS logs
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/logs_scene_test.cpp)
chase_test(logs_info_test
  LIBS log_tools
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/logs_info_test.cpp)
chase_test(logs_identify_test
  LIBS log_tools control_core config
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/logs_identify_test.cpp ${CMAKE_CURRENT_LIST_DIR}/logs_identified_files_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/logs_samples_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/logs_regression_test.cpp)
chase_test(logs_metrics_test
  LIBS metrics nlohmann_json::nlohmann_json
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/logs_metrics_test.cpp ${CMAKE_CURRENT_LIST_DIR}/logs_faults_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/logs_latency_test.cpp)
chase_test(collision_watch_test LIBS collision_watch
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/collision_watch_test.cpp)
chase_test(logs_report_test
  LIBS report
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/logs_report_test.cpp ${CMAKE_CURRENT_LIST_DIR}/logs_moments_test.cpp)

if(TARGET planning_core)
  chase_test(logs_verify_test LIBS log_tools planning_core
    SOURCES ${CMAKE_CURRENT_LIST_DIR}/logs_verify_test.cpp)
endif()

# Every message's name and the fingerprint that lcm-gen gave it.
get_directory_property(types DIRECTORY ${CMAKE_SOURCE_DIR}/lcmtypes DEFINITION types)
set(includes "")
set(fingerprints "")
foreach(type IN LISTS types)
  string(APPEND includes "#include \"chase/${type}_t.hpp\"\n")
  string(APPEND fingerprints "{\"${type}_t\", chase::${type}_t::getHash()},\n")
endforeach()
file(CONFIGURE OUTPUT migrate_test/all_types.h CONTENT "${includes}")
file(CONFIGURE OUTPUT migrate_test/fingerprints.inc CONTENT "${fingerprints}")
chase_test(logs_migrate_test
  LIBS log_tools
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/logs_migrate_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/logs_migrate_rules_test.cpp)
target_include_directories(logs_migrate_test PRIVATE ${CMAKE_CURRENT_BINARY_DIR}/migrate_test)

# The tools as a user calls them, where there is a program that flies.
if(TARGET chase-flight)
  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  chase_script_test(logs_cli ${CMAKE_CURRENT_LIST_DIR}/logs_cli_test.py ${CMAKE_BINARY_DIR}/bin)
  chase_script_test(logs_python ${CMAKE_CURRENT_LIST_DIR}/logs_python_test.py ${CMAKE_BINARY_DIR}/bin)
  add_test(NAME logs_mcap
    COMMAND ${Python3_EXECUTABLE} -B ${CMAKE_CURRENT_LIST_DIR}/mcap_size_test.py ${CMAKE_BINARY_DIR}/bin
            ${CMAKE_BINARY_DIR}/test/flight.lcm)
  set_tests_properties(logs_cli logs_python PROPERTIES TIMEOUT 300)
  set_tests_properties(logs_mcap PROPERTIES TIMEOUT 300 FIXTURES_REQUIRED recorded_flight SKIP_RETURN_CODE 77)
endif()
