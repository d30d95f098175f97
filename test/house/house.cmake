# house_check(NAME script arguments...): a Python script that exits 0 when the house is in order.
function(house_check name script)
  chase_script_test(house_${name} ${CMAKE_SOURCE_DIR}/test/house/${script} ${ARGN})
  set_tests_properties(house_${name} PROPERTIES TIMEOUT 300)
endfunction()

house_check(includes includes.py)
house_check(words words.py)
house_check(channels channels.py)
house_check(documents documents.py ${CMAKE_BINARY_DIR}/bin)
house_check(launcher launcher_test.py)
house_check(setup setup_test.py)
house_check(units units_test.py)
house_check(cli_pages cli_pages_test.py ${CMAKE_BINARY_DIR}/bin)
house_check(safety safety.py ${CMAKE_BINARY_DIR})
house_check(bad_use bad_use.py ${CMAKE_BINARY_DIR}/bin ${CHASE_SERVICES})

# Skipped tests, and none that hides a failure.
chase_program(skip_cases ${CMAKE_CURRENT_LIST_DIR}/skip_cases.cpp)
target_link_libraries(skip_cases PRIVATE test_main)
set_target_properties(skip_cases PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/test)
house_check(skips skips_test.py ${CMAKE_BINARY_DIR} $<TARGET_FILE:skip_cases>)
