# The cores as a CMake package for other programs: find_package(chase) gives chase::planning and
# chase::prediction, and chase::scene to read scene files. cmake --install BUILD --prefix DIR.
if(NOT TARGET planning_core OR NOT TARGET prediction_core)
  return()
endif()
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set_target_properties(planning_core PROPERTIES EXPORT_NAME planning)
set_target_properties(prediction_core PROPERTIES EXPORT_NAME prediction)
install(TARGETS chase_options math math_exact world separation plan_check scene planning_core prediction_core
  EXPORT chase COMPONENT development ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}/chase)

foreach(folder IN ITEMS common/math common/world services/planning services/prediction)
  install(DIRECTORY ${CMAKE_SOURCE_DIR}/${folder}/ COMPONENT development
    DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/chase/${folder}
    FILES_MATCHING PATTERN "*.h" PATTERN "*_node.h" EXCLUDE PATTERN "scenario.h" EXCLUDE)
endforeach()

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/chase)
install(EXPORT chase NAMESPACE chase:: FILE chase-targets.cmake COMPONENT development
  DESTINATION ${package})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/chase-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_SOURCE_DIR}/cmake/chase-config.cmake
  ${CMAKE_BINARY_DIR}/chase-config-version.cmake COMPONENT development DESTINATION ${package})
