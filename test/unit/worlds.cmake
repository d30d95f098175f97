if(TARGET worlds AND TARGET flight)
  chase_test(worlds_test LIBS worlds flight SOURCES ${CMAKE_CURRENT_LIST_DIR}/worlds_test.cpp
    TIMEOUT 600)
endif()
