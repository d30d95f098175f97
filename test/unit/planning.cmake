chase_test(planning_search_test
  LIBS planning_core math_exact
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/planning_search_test.cpp)
chase_test(planning_soundness_test
  LIBS planning_core math_exact
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/planning_soundness_test.cpp)
chase_test(planning_refinement_test
  LIBS planning_core math_exact
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/planning_refinement_test.cpp)
chase_test(planning_test
  LIBS planning_core math_exact
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/planning_ladder_test.cpp ${CMAKE_CURRENT_LIST_DIR}/planning_rungs_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/planning_problem_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/planning_ground_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/planning_pilot_test.cpp ${CMAKE_CURRENT_LIST_DIR}/planning_pilot_inputs_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/planning_last_resort_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/planning_evasion_test.cpp ${CMAKE_CURRENT_LIST_DIR}/planning_ratchet_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/planning_safety_test.cpp ${CMAKE_CURRENT_LIST_DIR}/planning_limits_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/planning_stopping_test.cpp ${CMAKE_CURRENT_LIST_DIR}/planning_way_out_test.cpp ${CMAKE_CURRENT_LIST_DIR}/planning_flights_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/planning_view_test.cpp ${CMAKE_CURRENT_LIST_DIR}/planning_task_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/planning_landing_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/planning_whereabouts_test.cpp)
chase_test(planning_node_test LIBS planning_node
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/planning_node_test.cpp)
# CHASE_PLANS=5000: of so many seeds, two plans each.
chase_test(planning_minkowski_test
  LIBS planning_core math_exact
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/planning_minkowski_test.cpp ${CMAKE_CURRENT_LIST_DIR}/planning_proofs_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/planning_margins_test.cpp ${CMAKE_CURRENT_LIST_DIR}/separation_model.cpp)
