chase_test(control_test LIBS control_core
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/control_test.cpp ${CMAKE_CURRENT_LIST_DIR}/control_law_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/control_plan_test.cpp)
chase_test(control_node_test LIBS control_node
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/control_node_test.cpp)
