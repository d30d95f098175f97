chase_test(recorder_test LIBS recorder logs
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/recorder_test.cpp)

# The process itself, live: rotation, a full disk, SIGTERM and SIGKILL.
add_test(NAME recorder_live
  COMMAND unshare --mount --net --map-root-user
          ${Python3_EXECUTABLE} -B ${CMAKE_CURRENT_LIST_DIR}/recorder_live_test.py ${CMAKE_BINARY_DIR}/bin)
set_tests_properties(recorder_live PROPERTIES TIMEOUT 120)
