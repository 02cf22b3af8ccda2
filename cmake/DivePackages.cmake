# Debian packages: dive (the command) and libdive-dev (find_package(dive)). `cpack` in the build tree
# makes both.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME dive)
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_CONTACT "${DIVE_MAINTAINER}")
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL runtime development)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_RELEASE 1)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ
    GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)

set(CPACK_DEBIAN_RUNTIME_PACKAGE_NAME dive)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SECTION science)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_RUNTIME_PACKAGE_RECOMMENDS "systemd")
if(DIVE_GDAL_LIBRARY MATCHES "^libgdal\\.so\\.([0-9]+)$")
  set(CPACK_DEBIAN_RUNTIME_PACKAGE_SUGGESTS "libgdal${CMAKE_MATCH_1}")
endif()
set(CPACK_DEBIAN_RUNTIME_PACKAGE_CONTROL_EXTRA ${CMAKE_SOURCE_DIR}/packaging/debian/postinst)
set(CPACK_COMPONENT_RUNTIME_DESCRIPTION
"mission executive for the Aqua2 underwater vehicle
 A mission is an XML file: dive checks on deck that it can work, dives it in
 a simulator or on the vehicle, replays the log bit for bit, and reports.")

# The packages whose libraries ours are linked with: those that build dive, without those for tests
# and GDAL, which is loaded.
file(STRINGS ${CMAKE_SOURCE_DIR}/packages.txt packages REGEX "^lib.*-dev$")
list(REMOVE_ITEM packages libgtest-dev libgmock-dev librapidcheck-dev libbenchmark-dev libcli11-dev libgdal-dev)
list(APPEND packages "dive (= ${PROJECT_VERSION}-1)")
list(JOIN packages ", " CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libdive-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION
"libraries of the mission executive dive
 Path planning with certified clearance, behaviours, and the simulator of the
 Aqua2 underwater vehicle, for find_package(dive) in CMake.")

# What policy asks of each package's folder in /usr/share/doc.
set(documents ${CMAKE_BINARY_DIR}/debian)
set(DIVE_SCRIPT_LICENCES "")
foreach(licence IN LISTS DIVE_REPORT_LICENCES)
  file(READ ${licence} text)
  string(APPEND DIVE_SCRIPT_LICENCES "\n${text}")
endforeach()
configure_file(packaging/debian/copyright.in ${documents}/copyright @ONLY)
configure_file(packaging/debian/changelog.in ${documents}/changelog.Debian @ONLY)
execute_process(COMMAND gzip -9nf ${documents}/changelog.Debian COMMAND_ERROR_IS_FATAL ANY)
install(FILES ${documents}/copyright ${documents}/changelog.Debian.gz
  DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/dive COMPONENT runtime)
install(FILES ${documents}/copyright ${documents}/changelog.Debian.gz
  DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/doc/libdive-dev COMPONENT development)
# Each of lintian's findings that is no defect, with the reason.
install(FILES packaging/debian/dive.lintian-overrides
  DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/lintian/overrides RENAME dive COMPONENT runtime)
install(FILES packaging/debian/libdive-dev.lintian-overrides
  DESTINATION ${CMAKE_INSTALL_DATAROOTDIR}/lintian/overrides RENAME libdive-dev
  COMPONENT development)
include(CPack)
