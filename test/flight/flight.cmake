# Closed-loop flights: in lockstep (twice, byte for byte), with faults, its replays, the forest, live over UDP.
set(scenario ${CMAKE_SOURCE_DIR}/deploy/scenarios/gym.yaml)
set(flight ${CMAKE_BINARY_DIR}/test/flight.lcm)
set(bin ${CMAKE_BINARY_DIR}/bin)

add_test(NAME flight_lockstep
  COMMAND ${CMAKE_SOURCE_DIR}/test/flight/lockstep.sh ${bin} ${scenario} ${flight})
set_tests_properties(flight_lockstep PROPERTIES TIMEOUT 300 FIXTURES_SETUP recorded_flight)

add_test(NAME flight_verify
  COMMAND python3 -B ${CMAKE_SOURCE_DIR}/test/flight/verify_test.py ${bin} ${flight})
set_tests_properties(flight_verify PROPERTIES TIMEOUT 120 FIXTURES_REQUIRED recorded_flight)

chase_script_test(flight_faults ${CMAKE_CURRENT_LIST_DIR}/faults_test.py ${bin} ${scenario})
set_tests_properties(flight_faults PROPERTIES TIMEOUT 300)

chase_script_test(flight_bars ${CMAKE_CURRENT_LIST_DIR}/bars_test.py)
set_tests_properties(flight_bars PROPERTIES TIMEOUT 30)

# Whole flights among trees, half minutes among people, and in the hall in which planning dies: criteria and bounds decide.
foreach(name IN ITEMS forest gym corridor crossing night)
  add_test(NAME flight_${name}
    COMMAND python3 -B ${CMAKE_SOURCE_DIR}/test/flight/bounds_test.py ${bin} ${name})
  set_tests_properties(flight_${name} PROPERTIES TIMEOUT 900)
endforeach()

# From take-off to the motors' end: on command, and by itself where the target is gone for good; criteria decide.
foreach(name IN ITEMS mission lost)
  add_test(NAME flight_${name}
    COMMAND ${bin}/chase-flight ${CMAKE_SOURCE_DIR}/deploy/scenarios/${name}.yaml --seed 1 --quiet)
  set_tests_properties(flight_${name} PROPERTIES TIMEOUT 300)
endforeach()

# Battery, geofence, kill, a blocked way up: each ends a mission with its reason.
chase_script_test(flight_envelope ${CMAKE_CURRENT_LIST_DIR}/envelope_test.py ${bin}
  ${CMAKE_SOURCE_DIR}/deploy/scenarios/mission.yaml)
set_tests_properties(flight_envelope PROPERTIES TIMEOUT 300)

foreach(row IN ITEMS "odometry:POSE;SCAN_REGISTERED" "mapping:OBSTACLES;MAP" "perception:TARGET"
                     "prediction:PREDICTION" "planning:PLAN" "control:ATTITUDE_SETPOINT"
                     "simulator:TRUTH;IMU;LIDAR_SCAN;CAMERA_IMAGE")
  string(REGEX REPLACE ":.*" "" service "${row}")
  string(REGEX REPLACE ".*:" "" channels "${row}")
  add_test(NAME replay_${service}
    COMMAND python3 ${CMAKE_SOURCE_DIR}/test/replay/replay_check.py ${bin} ${service} ${scenario}
            ${flight} ${channels})
  set_tests_properties(replay_${service} PROPERTIES TIMEOUT 300 FIXTURES_REQUIRED recorded_flight)
endforeach()

add_test(NAME hostile_bus
  COMMAND ${CMAKE_SOURCE_DIR}/test/flight/in_namespace.sh
          python3 ${CMAKE_SOURCE_DIR}/test/flight/hostile_bus.py ${bin} ${flight}
          ${CMAKE_SOURCE_DIR}/deploy/scenarios/mission.yaml
  WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
set_tests_properties(hostile_bus PROPERTIES TIMEOUT 300 FIXTURES_REQUIRED recorded_flight)

chase_script_test(flight_command ${CMAKE_CURRENT_LIST_DIR}/command_test.py ${bin}
  BEFORE ${CMAKE_SOURCE_DIR}/test/flight/in_namespace.sh)
set_tests_properties(flight_command PROPERTIES TIMEOUT 60)

add_test(NAME flight_live
  COMMAND ${CMAKE_SOURCE_DIR}/test/flight/in_namespace.sh deploy/fly gym --seed 1
  WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
set_tests_properties(flight_live PROPERTIES TIMEOUT 300 RUN_SERIAL TRUE)

# The same through the drivers; more seeds: test/flight/hardware 2 3 4.
if(TARGET simulator_hardware)
  add_test(NAME flight_hardware COMMAND ${CMAKE_SOURCE_DIR}/test/flight/hardware)
  set_tests_properties(flight_hardware PROPERTIES TIMEOUT 300 RUN_SERIAL TRUE)
endif()

# Its host's wall clock is set, and its disk fills up.
if(TARGET simulator_hardware)
  add_library(wall_clock MODULE ${CMAKE_CURRENT_LIST_DIR}/wall_clock.cpp)
  target_include_directories(wall_clock PRIVATE ${CMAKE_SOURCE_DIR})  # without sanitizers: not only our programs load it
  chase_script_test(flight_live_host ${CMAKE_CURRENT_LIST_DIR}/live_host_test.py ${bin} $<TARGET_FILE:wall_clock>
    BEFORE ${CMAKE_SOURCE_DIR}/test/flight/in_namespace.sh)
  set_tests_properties(flight_live_host PROPERTIES TIMEOUT 300 RUN_SERIAL TRUE)
endif()

# One process dies in it and comes back; every one at three times: test/flight/live_kills.
add_test(NAME flight_live_kill
  COMMAND ${CMAKE_SOURCE_DIR}/test/flight/live_kills --at 20 planning
  WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
set_tests_properties(flight_live_kill PROPERTIES TIMEOUT 300 RUN_SERIAL TRUE)

# Campaigns: their statistics, and the program with stand-ins for the flights.
chase_test(campaign_statistics_test LIBS statistics
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/campaign_statistics_test.cpp)
chase_script_test(flight_campaign ${CMAKE_CURRENT_LIST_DIR}/campaign_test.py ${bin})
set_tests_properties(flight_campaign PROPERTIES TIMEOUT 600)
