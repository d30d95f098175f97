# Warnings, sanitizers and code generation flags that every target of ours shares.
add_library(chase_options INTERFACE)
target_compile_options(chase_options INTERFACE
  "$<BUILD_INTERFACE:-Wall;-Wextra;-Wconversion;-Wshadow;-ffp-contract=off>")
target_include_directories(chase_options INTERFACE
  $<BUILD_INTERFACE:${CMAKE_SOURCE_DIR}> $<INSTALL_INTERFACE:include/chase>)
if(CHASE_WERROR)
  # GCC 12 sees a use after free in Eigen's own allocator where there is none.
  target_compile_options(chase_options INTERFACE
    "$<BUILD_INTERFACE:-Werror;-Wno-error=use-after-free>")
endif()
if(CHASE_NATIVE)
  target_compile_options(chase_options INTERFACE "$<BUILD_INTERFACE:-march=native>")
endif()
foreach(sanitizer IN LISTS CHASE_SANITIZE)
  target_compile_options(chase_options INTERFACE -fsanitize=${sanitizer} -fno-omit-frame-pointer)
  target_link_options(chase_options INTERFACE -fsanitize=${sanitizer})
endforeach()

# What most files include, read once for libraries and once for programs: of an ordinary file that
# is more than half of the work. Every file includes what it needs all the same.
set(precompiled <Eigen/Dense> <algorithm> <array> <cmath> <functional> <map> <memory> <optional>
  <sstream> <string> <unordered_map> <vector>)
file(TOUCH ${CMAKE_BINARY_DIR}/precompiled.cpp)
add_library(precompiled_library STATIC ${CMAKE_BINARY_DIR}/precompiled.cpp)
set_target_properties(precompiled_library PROPERTIES POSITION_INDEPENDENT_CODE ON)
add_library(precompiled_program STATIC ${CMAKE_BINARY_DIR}/precompiled.cpp)
foreach(kind IN ITEMS library program)
  target_link_libraries(precompiled_${kind} PRIVATE chase_options Eigen3::Eigen)
  target_precompile_headers(precompiled_${kind} PRIVATE ${precompiled})
endforeach()
# They serve only files with the same options: GLib's -pthread is everybody's.
target_compile_options(chase_options INTERFACE $<BUILD_INTERFACE:-pthread>)
if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
  target_compile_options(chase_options INTERFACE $<BUILD_INTERFACE:-fpch-preprocess>)  # for ccache
endif()

# chase_library(NAME sources...): a static library with our options.
function(chase_library name)
  add_library(${name} STATIC ${ARGN})
  target_link_libraries(${name} PUBLIC chase_options)
  set_target_properties(${name} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  target_precompile_headers(${name} REUSE_FROM precompiled_library)
endfunction()

# chase_program(NAME sources...): an executable in build/bin with our options.
function(chase_program name)
  add_executable(${name} ${ARGN})
  target_link_libraries(${name} PRIVATE chase_options version output_check)
  target_precompile_headers(${name} REUSE_FROM precompiled_program)
  set_property(GLOBAL APPEND PROPERTY CHASE_PROGRAMS ${name})
endfunction()

# chase_test(NAME LIBS... SOURCES... [TIMEOUT s]): a GoogleTest program registered with CTest.
function(chase_test name)
  cmake_parse_arguments(ARG "" "TIMEOUT" "LIBS;SOURCES" ${ARGN})
  chase_program(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_LIBS} test_main)
  set_target_properties(${name} PROPERTIES RUNTIME_OUTPUT_DIRECTORY ${CMAKE_BINARY_DIR}/test)
  add_test(NAME ${name} COMMAND ${name} WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
  if(NOT ARG_TIMEOUT)
    set(ARG_TIMEOUT 120)
  endif()
  set_tests_properties(${name} PROPERTIES TIMEOUT ${ARG_TIMEOUT} SKIP_RETURN_CODE 77)
endfunction()

# chase_script_test(NAME SCRIPT arguments...): a Python script of unittests, of which CTest hears when some are skipped.
# `BEFORE command` stands before Python.
function(chase_script_test name script)
  cmake_parse_arguments(ARG "" "" "BEFORE" ${ARGN})
  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  add_test(NAME ${name}
    COMMAND ${ARG_BEFORE} ${Python3_EXECUTABLE} -B ${CMAKE_SOURCE_DIR}/test/unittest_run.py ${script} ${ARG_UNPARSED_ARGUMENTS}
    WORKING_DIRECTORY ${CMAKE_SOURCE_DIR})
  set_tests_properties(${name} PROPERTIES SKIP_RETURN_CODE 77)
endfunction()

# chase_benchmark(NAME LIBS... SOURCES...): a Google Benchmark program build/bin/bench_*.
function(chase_benchmark name)
  cmake_parse_arguments(ARG "" "" "LIBS;SOURCES" ${ARGN})
  chase_program(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE ${ARG_LIBS} bench_main)
endfunction()
