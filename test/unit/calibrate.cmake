if(TARGET chase-calibrate)
  chase_test(calibrate_test
    LIBS calibrate simulator_core lcmtypes world opencv_calib3d opencv_imgproc opencv_imgcodecs PkgConfig::LCM fmt::fmt
    SOURCES ${CMAKE_CURRENT_LIST_DIR}/calibrate_test.cpp ${CMAKE_CURRENT_LIST_DIR}/calibrate_imu_test.cpp
            ${CMAKE_CURRENT_LIST_DIR}/calibrate_program_test.cpp)
  target_compile_definitions(calibrate_test PRIVATE CHASE_CALIBRATE="$<TARGET_FILE:chase-calibrate>")
  add_dependencies(calibrate_test chase-calibrate)
endif()
