chase_test(common_math_test
  LIBS math math_exact
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/common_math_polynomial_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/common_math_rotation_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/common_math_simplex_test.cpp)
chase_test(common_track_test LIBS track
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/common_track_test.cpp)
chase_test(world_view_angles_test LIBS world
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/world_view_angles_test.cpp)
chase_test(world_separation_test
  LIBS separation world
  SOURCES ${CMAKE_CURRENT_LIST_DIR}/world_separation_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/world_separation_check_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/world_body_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/world_manoeuvre_test.cpp
          ${CMAKE_CURRENT_LIST_DIR}/separation_model.cpp
  TIMEOUT 300)
