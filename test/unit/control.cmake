chase_test(control_test LIBS control_core log_tools config
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/control_test.cpp ${CMAKE_CURRENT_LIST_DIR}/control_law_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/control_drag_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/control_plan_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/control_lost_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/control_landing_test.cpp)
if(TARGET planning_core)
  chase_test(control_plan_check_test LIBS control_core planning_core
    SOURCES ${CMAKE_CURRENT_LIST_DIR}/control_plan_check_test.cpp)
endif()
chase_test(control_node_test LIBS control_node
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/control_node_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/control_state_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/control_fence_test.cpp)
