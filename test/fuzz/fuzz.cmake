# One program per reader of bytes from outside. With CHASE_FUZZ (test/fuzz/run: clang) it looks for
# inputs itself; else it reads those of corpus/, as a test.
option(CHASE_FUZZ "Build the fuzz targets with clang's libFuzzer" OFF)
set(fuzz ${CMAKE_CURRENT_LIST_DIR})

# Only what the configurations themselves are made of, where that is a file of its own.
set(services ${CMAKE_SOURCE_DIR}/services)
chase_library(service_configs ${services}/camera/config.cpp ${services}/control/control_config.cpp
  ${services}/fcu/fcu_config.cpp ${services}/lidar/config.cpp ${services}/link/link_config.cpp
  ${services}/mapping/mapping_config.cpp ${CMAKE_SOURCE_DIR}/deploy/recorder/recorder_config.cpp
  ${services}/mission/mission_config.cpp ${services}/odometry/odometry_config.cpp
  ${services}/perception/perception_config.cpp ${services}/viewer/viewer_config.cpp)
target_link_libraries(service_configs PUBLIC planning_core prediction_node simulator_core
  mission_core config)

function(chase_fuzz name)
  add_executable(fuzz_${name} ${fuzz}/fuzz_${name}.cpp)
  target_link_libraries(fuzz_${name} PRIVATE chase_options version ${ARGN})
  set_target_properties(fuzz_${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/test)
  if(CHASE_FUZZ)
    target_link_options(fuzz_${name} PRIVATE -fsanitize=fuzzer)
  else()
    target_sources(fuzz_${name} PRIVATE ${fuzz}/replay_main.cpp)
    add_test(NAME fuzz_${name} COMMAND fuzz_${name} ${fuzz}/corpus/${name})
    set_tests_properties(fuzz_${name} PROPERTIES TIMEOUT 60)
  endif()
  set_property(GLOBAL APPEND PROPERTY CHASE_FUZZERS fuzz_${name})
endfunction()

chase_fuzz(messages log_tools logs bus)
chase_fuzz(log log_tools logs)
chase_fuzz(scenario scenario)
chase_fuzz(scene scene)
chase_fuzz(config service_configs)
chase_fuzz(vlp16 lidar_core)
chase_fuzz(pcap lidar_source)
chase_fuzz(mavlink fcu_core)
chase_fuzz(mission mission_node log_tools)
chase_fuzz(link link_core)
get_property(fuzzers GLOBAL PROPERTY CHASE_FUZZERS)
add_custom_target(fuzzers DEPENDS ${fuzzers})

add_executable(fuzz_corpus EXCLUDE_FROM_ALL ${fuzz}/corpus_main.cpp)
target_link_libraries(fuzz_corpus PRIVATE chase_options service_configs log_tools logs bus scenario fcu_core lidar_core)
set_target_properties(fuzz_corpus PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/test)

# The process table is read in Python.
add_test(NAME fuzz_processes
  COMMAND ${Python3_EXECUTABLE} -B ${fuzz}/fuzz_processes.py ${fuzz}/corpus/processes)

chase_script_test(fuzz_corpus_accepted ${fuzz}/corpus_test.py ${CMAKE_BINARY_DIR}/bin)
