find_package(Python3 REQUIRED COMPONENTS Interpreter)

# house_check(NAME script arguments...): a Python script that exits 0 when the house is in order.
function(house_check name script)
  add_test(NAME house_${name}
    COMMAND ${Python3_EXECUTABLE} -B ${CMAKE_SOURCE_DIR}/test/house/${script} ${ARGN}
    WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
  set_tests_properties(house_${name} PROPERTIES TIMEOUT 300)
endfunction()

house_check(includes includes.py)
house_check(words words.py)
house_check(channels channels.py)
house_check(documents documents.py ${CMAKE_BINARY_DIR}/bin)
house_check(launcher launcher_test.py)
house_check(setup setup_test.py)
house_check(cli_pages cli_pages_test.py ${CMAKE_BINARY_DIR}/bin)
house_check(safety safety.py ${CMAKE_BINARY_DIR})
house_check(bad_use bad_use.py ${CMAKE_BINARY_DIR}/bin ${CHASE_SERVICES})
