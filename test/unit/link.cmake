chase_test(link_test LIBS link_node SOURCES ${CMAKE_CURRENT_LIST_DIR}/link_test.cpp)

# Two vehicles and their ground stations in network namespaces, over a path that loses, delays and limits.
chase_script_test(link_two_hosts ${CMAKE_SOURCE_DIR}/test/link/two_hosts.py
  ${CMAKE_BINARY_DIR}/bin ${CMAKE_BINARY_DIR}/test/flight.lcm BEFORE unshare --net --map-root-user)
set_tests_properties(link_two_hosts PROPERTIES RUN_SERIAL TRUE TIMEOUT 180 FIXTURES_REQUIRED recorded_flight)
