# bench_perception and perception_campaign fly through the simulator's worlds; not part of ctest.
if(TARGET simulator_core)
  set(stage_dir ${CMAKE_SOURCE_DIR}/test/perception)
  add_library(perception_stage STATIC ${stage_dir}/stage.cpp ${stage_dir}/show.cpp
    ${stage_dir}/fly.cpp ${stage_dir}/score.cpp)
  target_link_libraries(perception_stage PUBLIC perception_core simulator_core)
  target_include_directories(perception_stage PUBLIC ${stage_dir})
  chase_benchmark(bench_perception LIBS perception_stage
    SOURCES ${CMAKE_CURRENT_LIST_DIR}/bench_perception.cpp)
  chase_program(perception_campaign ${stage_dir}/campaign.cpp)
  target_link_libraries(perception_campaign PRIVATE perception_stage config opencv_imgcodecs
    CLI11::CLI11 fmt::fmt)
endif()
chase_program(perception_photos ${CMAKE_SOURCE_DIR}/test/perception/photos.cpp)
target_link_libraries(perception_photos PRIVATE detect perception_core config opencv_imgcodecs
  opencv_imgproc opencv_photo CLI11::CLI11 fmt::fmt)
