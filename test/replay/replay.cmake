# Golden replays: each service against what it sent when its golden was recorded.
foreach(golden IN ITEMS odometry mapping perception prediction planning control simulator planning_lidar_gap
                        mapping_forest mission)
  set(world gym)
  if(golden MATCHES "_forest$")
    set(world forest)
  elseif(golden STREQUAL "mission")
    set(world mission)
  endif()
  add_test(NAME golden_replay_${golden}
    COMMAND python3 ${CMAKE_SOURCE_DIR}/test/replay/golden.py check ${CMAKE_BINARY_DIR}/bin
            ${CMAKE_SOURCE_DIR}/deploy/scenarios/${world}.yaml ${golden}
    WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
  set_tests_properties(golden_replay_${golden} PROPERTIES TIMEOUT 120)
endforeach()

chase_script_test(golden_script ${CMAKE_CURRENT_LIST_DIR}/golden_test.py)

# A recorded drive through the programs; skips where the recording is not at hand.
chase_test(kitti_map_test LIBS lcmtypes fmt::fmt octomap octomath TIMEOUT 200
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/kitti_map_test.cpp)
target_compile_definitions(kitti_map_test PRIVATE CHASE_BIN="${CMAKE_BINARY_DIR}/bin")
