chase_test(recorder_test LIBS recorder logs
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/recorder_test.cpp)

# The process itself, live: rotation, a full disk, SIGTERM and SIGKILL.
chase_script_test(recorder_live ${CMAKE_CURRENT_LIST_DIR}/recorder_live_test.py ${CMAKE_BINARY_DIR}/bin
  BEFORE unshare --mount --net --map-root-user)
set_tests_properties(recorder_live PROPERTIES TIMEOUT 120)
