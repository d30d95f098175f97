# Flights of the simulated sensors for odometry's figures; see README.md. Not part of CTest: minutes.
foreach(service IN ITEMS odometry simulator control)
  if(NOT TARGET ${service}_node)
    return()
  endif()
endforeach()

chase_program(odometry_trial ${CMAKE_CURRENT_LIST_DIR}/trial_main.cpp
  ${CMAKE_CURRENT_LIST_DIR}/courses.cpp ${CMAKE_CURRENT_LIST_DIR}/trial_flight.cpp
  ${CMAKE_CURRENT_LIST_DIR}/faults.cpp ${CMAKE_CURRENT_LIST_DIR}/judge.cpp)
target_link_libraries(odometry_trial PRIVATE simulator_node odometry_node control_node log_tools
  scenario CLI11::CLI11 fmt::fmt)
set_target_properties(odometry_trial PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/test)

# Odometry and simulator in one process, without a bus.
chase_test(odometry_live_test LIBS simulator_core control_core odometry_core scenario fmt::fmt TIMEOUT 200
  SOURCES ${CMAKE_SOURCE_DIR}/test/unit/odometry_live_test.cpp ${CMAKE_CURRENT_LIST_DIR}/live_trial.cpp
    ${CMAKE_CURRENT_LIST_DIR}/courses.cpp)
chase_test(odometry_imu_fault_test LIBS simulator_core control_core odometry_core scenario fmt::fmt TIMEOUT 200
  SOURCES ${CMAKE_SOURCE_DIR}/test/unit/odometry_imu_fault_test.cpp ${CMAKE_CURRENT_LIST_DIR}/live_trial.cpp
    ${CMAKE_CURRENT_LIST_DIR}/courses.cpp)
