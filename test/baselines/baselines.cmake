# The planners of the comparison. Each registers itself, hence object files and not an archive's
# members; a planner of one's own joins by one line here.
pkg_check_modules(NLOPT REQUIRED IMPORTED_TARGET nlopt)
add_library(baselines OBJECT
  ${CMAKE_CURRENT_LIST_DIR}/registry.cpp
  ${CMAKE_CURRENT_LIST_DIR}/pieces.cpp
  ${CMAKE_CURRENT_LIST_DIR}/rival.cpp
  ${CMAKE_CURRENT_LIST_DIR}/nlp.cpp
  ${CMAKE_CURRENT_LIST_DIR}/tuning.cpp
  ${CMAKE_CURRENT_LIST_DIR}/example/follow_behind.cpp
  ${CMAKE_CURRENT_LIST_DIR}/hierarchical/distance_field.cpp
  ${CMAKE_CURRENT_LIST_DIR}/hierarchical/view_graph.cpp
  ${CMAKE_CURRENT_LIST_DIR}/hierarchical/quadratic_program.cpp
  ${CMAKE_CURRENT_LIST_DIR}/hierarchical/corridor.cpp
  ${CMAKE_CURRENT_LIST_DIR}/hierarchical/hierarchical.cpp
  ${CMAKE_CURRENT_LIST_DIR}/penin_style/spline.cpp
  ${CMAKE_CURRENT_LIST_DIR}/penin_style/tracking_nlp.cpp
  ${CMAKE_CURRENT_LIST_DIR}/penin_style/penin_style.cpp
  ${CMAKE_CURRENT_LIST_DIR}/naegeli_style/framing_nlp.cpp
  ${CMAKE_CURRENT_LIST_DIR}/naegeli_style/naegeli_style.cpp)
target_link_libraries(baselines PUBLIC chase_options planning_core PkgConfig::NLOPT)
target_compile_definitions(baselines PRIVATE CHASE_BASELINES="${CMAKE_CURRENT_LIST_DIR}")

chase_test(baselines_test
  LIBS baselines
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/gradient_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/hierarchical/hierarchical_test.cpp)
chase_test(planner_contract_test
  LIBS baselines compare
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/contract_test.cpp
  TIMEOUT 300)
