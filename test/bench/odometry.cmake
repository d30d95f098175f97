pkg_check_modules(PCL_REGISTRATION REQUIRED IMPORTED_TARGET pcl_registration pcl_search pcl_kdtree
  pcl_filters pcl_common)
set(ODOMETRY_BENCH_DIR ${CMAKE_CURRENT_LIST_DIR})

# PCL's headers are compiled without our warnings.
add_library(odometry_pcl_rival STATIC ${ODOMETRY_BENCH_DIR}/odometry_pcl_rival.cpp)
target_include_directories(odometry_pcl_rival PRIVATE ${CMAKE_SOURCE_DIR})
target_link_libraries(odometry_pcl_rival PUBLIC Eigen3::Eigen PRIVATE PkgConfig::PCL_REGISTRATION)

chase_benchmark(bench_odometry LIBS odometry_test_support odometry_pcl_rival Ceres::ceres
  SOURCES ${ODOMETRY_BENCH_DIR}/bench_odometry.cpp
    ${ODOMETRY_BENCH_DIR}/../unit/odometry_ceres.cpp)
