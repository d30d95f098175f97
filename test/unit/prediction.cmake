chase_test(prediction_search_test LIBS prediction_core SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/prediction_search_test.cpp)
chase_test(prediction_predictor_test LIBS prediction_core SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/prediction_predictor_test.cpp)
chase_test(prediction_window_test LIBS prediction_core SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/prediction_window_test.cpp)
chase_test(prediction_node_test LIBS prediction_node SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/prediction_node_test.cpp)
chase_test(prediction_kernels_test LIBS prediction_core SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/prediction_kernels_test.cpp)
chase_test(prediction_motion_test LIBS prediction_core SOURCES
  ${CMAKE_CURRENT_LIST_DIR}/prediction_motion_test.cpp)
