chase_test(mission_test LIBS mission_core separation
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/mission_states_test.cpp ${CMAKE_CURRENT_LIST_DIR}/mission_core_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/mission_autopilot_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/mission_commands_test.cpp ${CMAKE_CURRENT_LIST_DIR}/mission_envelope_test.cpp)
chase_test(mission_node_test LIBS mission_node fcu_core
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/mission_node_test.cpp)
chase_test(mission_failsafe_test LIBS mission_node fcu_core fcu_stand_in
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/mission_failsafe_test.cpp)
if(TARGET planning_core)
  chase_test(mission_return_test LIBS mission_core planning_core
    SOURCES ${CMAKE_CURRENT_LIST_DIR}/mission_return_test.cpp)
endif()
