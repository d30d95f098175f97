# The cores as others use them: as a CMake package, and as programs on scene files.
if(NOT TARGET planning_core OR NOT TARGET prediction_core)
  return()
endif()
set(consumer_flags)
foreach(sanitizer IN LISTS CHASE_SANITIZE)
  string(APPEND consumer_flags " -fsanitize=${sanitizer}")
endforeach()
add_test(NAME package_consumer COMMAND ${CMAKE_COMMAND} -DSOURCE=${CMAKE_SOURCE_DIR}
  -DBUILD=${CMAKE_BINARY_DIR} "-DCXX_FLAGS=${consumer_flags}"
  -P ${CMAKE_CURRENT_LIST_DIR}/consumer.cmake)
set_tests_properties(package_consumer PROPERTIES TIMEOUT 180)
add_test(NAME scenes COMMAND python3 ${CMAKE_CURRENT_LIST_DIR}/scenes.py
  $<TARGET_FILE_DIR:chase-plan> ${CMAKE_SOURCE_DIR}/deploy/scenarios/scenes)
set_tests_properties(scenes PROPERTIES TIMEOUT 60)
# The Debian package: made, judged, unpacked, flown.
if(TARGET package_contents)
  chase_script_test(package_deb ${CMAKE_CURRENT_LIST_DIR}/deb_test.py ${CMAKE_BINARY_DIR})
  set_tests_properties(package_deb PROPERTIES TIMEOUT 400)
endif()
