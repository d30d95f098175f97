# chase_VERSION_ARCH.deb for a vehicle or a desk: `deploy/build`, then `cpack` in the build folder.
get_property(programs GLOBAL PROPERTY CHASE_PROGRAMS)
list(FILTER programs INCLUDE REGEX "^chase-")
foreach(program IN ITEMS chase-flight chase-report chase-recorder chase-viewer chase-fcu chase-link)
  if(NOT program IN_LIST programs)
    return()  # a build of some services
  endif()
endforeach()
include(GNUInstallDirs)
find_package(Python3 REQUIRED COMPONENTS Interpreter)
find_package(Java 17 COMPONENTS Development)

# What is made of the programs and of the process table.
set(deploy ${CMAKE_SOURCE_DIR}/deploy)
set(contents ${CMAKE_BINARY_DIR}/package)
add_custom_command(
  OUTPUT ${contents}/done
  COMMAND ${Python3_EXECUTABLE} -B ${deploy}/cli_pages.py ${CMAKE_BINARY_DIR}/bin ${CMAKE_BINARY_DIR} ${programs}
  COMMAND ${Python3_EXECUTABLE} -B ${deploy}/systemd/units.py ${deploy}/processes.json ${contents}/systemd
  COMMAND ${Python3_EXECUTABLE} -B ${deploy}/package/contents.py ${CMAKE_BINARY_DIR} ${contents} ${PROJECT_VERSION}
  COMMAND ${CMAKE_COMMAND} -E touch ${contents}/done
  DEPENDS ${programs} ${deploy}/cli_pages.py ${deploy}/systemd/units.py ${deploy}/processes.json
          ${deploy}/package/contents.py ${deploy}/launcher/script.py ${CMAKE_SOURCE_DIR}/CHANGELOG.md
  VERBATIM)
set(jar ${CMAKE_BINARY_DIR}/share/chase/chase_types.jar)
file(GLOB types CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/lcmtypes/*_t.lcm)
add_custom_command(
  OUTPUT ${jar}
  COMMAND ${CMAKE_COMMAND} -DLCM_GEN=${LCM_GEN} -DJAVAC=${Java_JAVAC_EXECUTABLE} -DJAR=${Java_JAR_EXECUTABLE}
          -DOUT=${jar} -DWORK=${contents}/java "-DTYPES=${types}" -P ${CMAKE_SOURCE_DIR}/cmake/JavaTypes.cmake
  DEPENDS ${types} ${CMAKE_SOURCE_DIR}/cmake/JavaTypes.cmake
  VERBATIM)
add_custom_target(package_contents ALL DEPENDS ${contents}/done ${jar})
add_dependencies(package_contents python_types report_assets viewer_page)

set(CMAKE_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
function(install_here destination)
  install(FILES ${ARGN} DESTINATION ${destination} COMPONENT vehicle)
endfunction()
install(TARGETS ${programs} COMPONENT vehicle RUNTIME DESTINATION bin)
install(PROGRAMS ${deploy}/package/chase-fly ${deploy}/package/chase-doctor DESTINATION bin COMPONENT vehicle)
install(PROGRAMS ${deploy}/systemd/back-off DESTINATION libexec/chase COMPONENT vehicle)
install(PROGRAMS ${deploy}/spy DESTINATION bin RENAME chase-spy COMPONENT vehicle)
foreach(module IN ITEMS bus commands devices doctor fly places processes results strain vehicle version)
  install_here(share/chase/launcher ${deploy}/launcher/${module}.py)
endforeach()
install_here(share/chase ${deploy}/processes.json)
install(DIRECTORY ${deploy}/scenarios DESTINATION share/chase COMPONENT vehicle
  FILES_MATCHING PATTERN "*.yaml" PATTERN "*.csv")
install(DIRECTORY ${CMAKE_BINARY_DIR}/share/chase DESTINATION share COMPONENT vehicle
  PATTERN "scenarios" EXCLUDE PATTERN "__pycache__" EXCLUDE)
install(DIRECTORY ${contents}/man1 DESTINATION share/man COMPONENT vehicle)
install(DIRECTORY ${contents}/completions DESTINATION share/bash-completion COMPONENT vehicle)
install_here(share/doc/chase ${contents}/changelog.gz ${deploy}/package/copyright ${deploy}/DEPLOYMENT.md)
install(FILES ${deploy}/package/lintian-overrides DESTINATION share/lintian/overrides RENAME chase COMPONENT vehicle)
install(DIRECTORY ${contents}/etc/ DESTINATION /etc/chase COMPONENT vehicle)
install_here(/etc/chase ${deploy}/package/environment)
install(DIRECTORY ${contents}/systemd/ DESTINATION /lib/systemd/system COMPONENT vehicle)
install_here(/lib/systemd/system ${deploy}/systemd/chase-network.service)
install_here(lib/sysctl.d ${deploy}/package/60-chase.conf)
install(FILES ${deploy}/package/sysusers.conf DESTINATION lib/sysusers.d RENAME chase.conf COMPONENT vehicle)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_COMPONENTS_ALL vehicle)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGE_CONTACT "chase authors <authors@chase.example>")
set(CPACK_DEBIAN_VEHICLE_PACKAGE_NAME chase)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_PRIORITY optional)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS
  "python3, iproute2, procps, gnuplot-nox | gnuplot, init-system-helpers (>= 1.54), systemd | systemd-standalone-sysusers | systemd-sysusers")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS liblcm-bin)
set(CPACK_DEBIAN_PACKAGE_SUGGESTS "default-jre, liblcm-java, libjchart2d-java, gstreamer1.0-plugins-base, gstreamer1.0-plugins-good")
set(CPACK_COMPONENT_VEHICLE_DESCRIPTION "drone that flies behind a moving target
Finds a target and the obstacles with a LiDAR, a camera and an IMU, predicts
where the target goes, and flies a multicopter with a PX4 autopilot behind it
without touching anything or losing sight of it.

The processes of the vehicle with their systemd units, a simulator, and the
tools that record, show and judge flights.")
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${deploy}/package/postinst ${deploy}/package/prerm ${deploy}/package/postrm
  ${contents}/conffiles)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)  # cpack packs what is built
include(CPack)
