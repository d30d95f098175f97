set(compare ${CMAKE_CURRENT_LIST_DIR})
chase_library(compare ${compare}/mission.cpp ${compare}/rollout.cpp ${compare}/score.cpp
  ${compare}/flight_file.cpp ${compare}/campaign.cpp ${compare}/results.cpp ${compare}/figure.cpp
  ${compare}/page.cpp)
target_link_libraries(compare PUBLIC scenario campaign planning_core pictures nlohmann_json::nlohmann_json
  PRIVATE fmt::fmt)
target_compile_definitions(compare PRIVATE
  CHASE_TWELVE="${CMAKE_SOURCE_DIR}/deploy/scenarios/twelve")

chase_program(chase-compare ${compare}/main.cpp)
target_link_libraries(chase-compare PRIVATE compare baselines CLI11::CLI11)
configure_file(${compare}/comparison.html ${CMAKE_BINARY_DIR}/share/chase/comparison.html COPYONLY)
add_dependencies(chase-compare report_assets)

chase_test(compare_test LIBS baselines compare SOURCES ${compare}/compare_test.cpp)
chase_script_test(compare_campaign ${compare}/campaign_test.py ${CMAKE_BINARY_DIR}/bin)
set_tests_properties(compare_campaign PROPERTIES TIMEOUT 300)
