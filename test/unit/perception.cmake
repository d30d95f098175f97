set(perception_test_dir ${CMAKE_CURRENT_LIST_DIR})
add_library(perception_world STATIC ${perception_test_dir}/perception_world.cpp)
target_link_libraries(perception_world PUBLIC perception_core)
target_include_directories(perception_world PUBLIC ${perception_test_dir})

chase_test(perception_image_test
  LIBS perception_world detect opencv_imgproc opencv_imgcodecs opencv_aruco opencv_dnn
  SOURCES ${perception_test_dir}/perception_detector_test.cpp
          ${perception_test_dir}/perception_marker_test.cpp
          ${perception_test_dir}/perception_network_test.cpp
          ${perception_test_dir}/perception_photo_test.cpp)
chase_test(perception_solver_test LIBS perception_core Ceres::ceres
  SOURCES ${perception_test_dir}/perception_solver_test.cpp)
chase_test(perception_camera_test LIBS perception_core opencv_calib3d
  SOURCES ${perception_test_dir}/perception_camera_test.cpp)
chase_test(perception_pieces_test LIBS perception_world opencv_imgproc
  SOURCES ${perception_test_dir}/perception_pieces_test.cpp)
chase_test(perception_test LIBS perception_world
  SOURCES ${perception_test_dir}/perception_fit_test.cpp
          ${perception_test_dir}/perception_flight_test.cpp
          ${perception_test_dir}/perception_candidate_test.cpp
          ${perception_test_dir}/perception_alike_test.cpp)
chase_test(perception_node_test LIBS perception_world perception_node
  SOURCES ${perception_test_dir}/perception_node_test.cpp)
chase_test(perception_select_test LIBS perception_world perception_node opencv_imgproc
  SOURCES ${perception_test_dir}/perception_select_test.cpp)
chase_test(perception_detect_test
  LIBS detect perception_core config opencv_imgproc opencv_imgcodecs opencv_videoio
       nlohmann_json::nlohmann_json
  SOURCES ${perception_test_dir}/perception_detect_test.cpp)
