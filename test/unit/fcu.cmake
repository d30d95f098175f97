chase_test(fcu_framing_test LIBS fcu_core world
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/fcu_framing_test.cpp ${CMAKE_CURRENT_LIST_DIR}/fcu_signing_test.cpp)

# A stand-in for PX4, for tests in logical time and live ones.
chase_library(fcu_stand_in ${CMAKE_SOURCE_DIR}/test/fcu/stand_in.cpp)
target_link_libraries(fcu_stand_in PUBLIC fcu_core simulator_px4 world)
chase_test(fcu_test LIBS fcu_core fcu_stand_in fcu_transport bus math world
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/fcu_conversions_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/fcu_parts_test.cpp ${CMAKE_CURRENT_LIST_DIR}/fcu_handshake_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/fcu_handshake_hands_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/fcu_bridge_test.cpp ${CMAKE_CURRENT_LIST_DIR}/fcu_hands_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/fcu_failsafe_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/fcu_touchdown_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/fcu_frame_test.cpp ${CMAKE_CURRENT_LIST_DIR}/fcu_transport_test.cpp)

# Byte for byte against node-mavlink, both ways. On demand more: node fcu_exchange.mjs PROGRAM 100000
chase_program(fcu_exchange ${CMAKE_CURRENT_LIST_DIR}/fcu_exchange.cpp)
target_link_libraries(fcu_exchange PRIVATE fcu_core world)
set_target_properties(fcu_exchange PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/test)
add_test(NAME fcu_exchange
  COMMAND ${NODE} ${CMAKE_CURRENT_LIST_DIR}/fcu_exchange.mjs $<TARGET_FILE:fcu_exchange> 4000)
set_tests_properties(fcu_exchange PROPERTIES TIMEOUT 120)

# Random and mutated bytes; for longer: build-asan/test/fcu_fuzz 60.
chase_program(fcu_fuzz ${CMAKE_CURRENT_LIST_DIR}/fcu_fuzz.cpp)
target_link_libraries(fcu_fuzz PRIVATE fcu_core world)
set_target_properties(fcu_fuzz PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/test)
add_test(NAME fcu_fuzz COMMAND fcu_fuzz 2)

# The process itself, live, against the stand-in.
chase_program(fcu_live_test ${CMAKE_SOURCE_DIR}/test/fcu/fcu_live_test.cpp)
target_link_libraries(fcu_live_test PRIVATE fcu_stand_in bus math test_main)
target_compile_definitions(fcu_live_test PRIVATE CHASE_FCU="$<TARGET_FILE:chase-fcu>")
add_dependencies(fcu_live_test chase-fcu)
set_target_properties(fcu_live_test PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/test)
add_test(NAME fcu_live
  COMMAND ${CMAKE_SOURCE_DIR}/test/flight/in_namespace.sh $<TARGET_FILE:fcu_live_test>
  WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
set_tests_properties(fcu_live PROPERTIES TIMEOUT 240 RUN_SERIAL TRUE SKIP_RETURN_CODE 77)
