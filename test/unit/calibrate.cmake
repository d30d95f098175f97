if(TARGET calibrate)
  chase_test(calibrate_test LIBS calibrate world opencv_calib3d opencv_imgproc
    SOURCES ${CMAKE_CURRENT_LIST_DIR}/calibrate_test.cpp)
endif()
