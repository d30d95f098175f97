# Golden replays: each service against what it sent when its golden was recorded.
foreach(service IN ITEMS odometry mapping perception prediction planning control simulator)
  add_test(NAME golden_replay_${service}
    COMMAND python3 ${CMAKE_SOURCE_DIR}/test/replay/golden.py check ${CMAKE_BINARY_DIR}/bin
            ${CMAKE_SOURCE_DIR}/deploy/scenarios/gym.yaml ${service}
    WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
  set_tests_properties(golden_replay_${service} PROPERTIES TIMEOUT 120)
endforeach()
