chase_test(common_math_test
  LIBS math math_exact
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/common_math_polynomial_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/common_math_rotation_test.cpp)
