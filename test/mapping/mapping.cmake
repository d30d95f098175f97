# mapping_campaign: minutes of flights through the simulator's worlds; not part of ctest.
if(NOT TARGET simulator_core)
  return()
endif()
chase_program(mapping_campaign ${CMAKE_CURRENT_LIST_DIR}/campaign.cpp
  ${CMAKE_CURRENT_LIST_DIR}/stage.cpp ${CMAKE_CURRENT_LIST_DIR}/score.cpp)
target_link_libraries(mapping_campaign PRIVATE mapping_core simulator_core config CLI11::CLI11
  fmt::fmt)
set_target_properties(mapping_campaign PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/test)
if(TARGET worlds)
  chase_program(mapping_walkers ${CMAKE_CURRENT_LIST_DIR}/walkers_main.cpp
    ${CMAKE_CURRENT_LIST_DIR}/walkers.cpp ${CMAKE_CURRENT_LIST_DIR}/stage.cpp)
  target_link_libraries(mapping_walkers PRIVATE mapping_core worlds statistics config CLI11::CLI11
    fmt::fmt)
  set_target_properties(mapping_walkers PROPERTIES RUNTIME_OUTPUT_DIRECTORY
    ${CMAKE_BINARY_DIR}/test)
endif()
