chase_test(viewer_core_test
  LIBS viewer_core nlohmann_json::nlohmann_json
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/viewer_core_test.cpp ${CMAKE_CURRENT_LIST_DIR}/viewer_foxglove_test.cpp)
chase_test(viewer_node_test
  LIBS viewer_node nlohmann_json::nlohmann_json
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/viewer_node_test.cpp ${CMAKE_CURRENT_LIST_DIR}/viewer_commander_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/viewer_any_log_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/viewer_age_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/viewer_image_test.cpp)
add_dependencies(viewer_node_test viewer_page)

add_test(NAME viewer_commands
  COMMAND ${CMAKE_SOURCE_DIR}/test/flight/in_namespace.sh
          ${NODE} ${CMAKE_SOURCE_DIR}/test/viewer/commands_test.mjs ${CMAKE_BINARY_DIR}/bin none
          ${CMAKE_SOURCE_DIR}/services/viewer/node_modules)
set_tests_properties(viewer_commands PROPERTIES TIMEOUT 120)

# The program with a short log: Foxglove's published client, hostile ones, a slow link, Chromium; reports.
foreach(name IN ITEMS foxglove hostile link page report)
  add_test(NAME viewer_${name}
    COMMAND ${NODE} ${CMAKE_SOURCE_DIR}/test/viewer/${name}_test.mjs ${CMAKE_BINARY_DIR}/bin
            ${CMAKE_BINARY_DIR}/test/flight.lcm ${CMAKE_SOURCE_DIR}/services/viewer/node_modules)
  set_tests_properties(viewer_${name} PROPERTIES TIMEOUT 180 FIXTURES_REQUIRED recorded_flight SKIP_RETURN_CODE 77)
endforeach()
set_tests_properties(viewer_report PROPERTIES TIMEOUT 400)  # seven pages
