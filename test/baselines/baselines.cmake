# The planners of the comparison. Each registers itself, hence object files and not an archive's
# members; a planner of one's own joins by one line here.
add_library(baselines OBJECT
  ${CMAKE_CURRENT_LIST_DIR}/registry.cpp
  ${CMAKE_CURRENT_LIST_DIR}/pieces.cpp
  ${CMAKE_CURRENT_LIST_DIR}/rival.cpp
  ${CMAKE_CURRENT_LIST_DIR}/hierarchical/distance_field.cpp
  ${CMAKE_CURRENT_LIST_DIR}/hierarchical/view_graph.cpp
  ${CMAKE_CURRENT_LIST_DIR}/hierarchical/quadratic_program.cpp
  ${CMAKE_CURRENT_LIST_DIR}/hierarchical/corridor.cpp
  ${CMAKE_CURRENT_LIST_DIR}/hierarchical/hierarchical.cpp)
target_link_libraries(baselines PUBLIC chase_options planning_core)
