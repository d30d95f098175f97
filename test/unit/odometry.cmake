set(ODOMETRY_TEST_DIR ${CMAKE_CURRENT_LIST_DIR})
add_library(odometry_test_support STATIC ${ODOMETRY_TEST_DIR}/odometry_synthetic.cpp
  ${ODOMETRY_TEST_DIR}/odometry_course.cpp ${ODOMETRY_TEST_DIR}/odometry_kitti.cpp)
target_link_libraries(odometry_test_support PUBLIC odometry_core PRIVATE PkgConfig::LZMA)

chase_test(odometry_parts_test LIBS odometry_test_support
  SOURCES ${ODOMETRY_TEST_DIR}/odometry_parts_test.cpp ${ODOMETRY_TEST_DIR}/odometry_filter_test.cpp)
chase_test(odometry_level_test LIBS odometry_test_support
  SOURCES ${ODOMETRY_TEST_DIR}/odometry_level_test.cpp)
chase_test(odometry_match_test LIBS odometry_test_support Ceres::ceres
  SOURCES ${ODOMETRY_TEST_DIR}/odometry_match_test.cpp ${ODOMETRY_TEST_DIR}/odometry_ceres.cpp)
chase_test(odometry_flight_test LIBS odometry_test_support
  SOURCES ${ODOMETRY_TEST_DIR}/odometry_flight_test.cpp ${ODOMETRY_TEST_DIR}/odometry_late_test.cpp)
chase_test(odometry_kitti_test LIBS odometry_test_support
  SOURCES ${ODOMETRY_TEST_DIR}/odometry_kitti_test.cpp)
chase_test(odometry_node_test LIBS odometry_test_support odometry_node
  SOURCES ${ODOMETRY_TEST_DIR}/odometry_node_test.cpp)
include(${ODOMETRY_TEST_DIR}/../odometry/odometry.cmake)
