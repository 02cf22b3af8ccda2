# What is installed, in two components: `runtime` (the command, its missions, man pages, completions,
# systemd units) and `development` (libraries, headers, find_package(dive)).
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(DIVE_DATA ${CMAKE_INSTALL_DATADIR}/dive)
set(DIVE_PACKAGE ${CMAKE_INSTALL_LIBDIR}/cmake/dive)

# --- runtime ---

# Man pages and completions are made from the definition of the commands and options, by the command.
set(share ${CMAKE_BINARY_DIR}/share)
add_custom_command(OUTPUT ${share}/man/man1/dive.1.gz
  COMMAND ${CMAKE_COMMAND} -E rm -rf ${share}
  COMMAND sh -c "$<TARGET_FILE:dive> generate ${share} > /dev/null && gzip -9n ${share}/man/man1/*.1"
  DEPENDS dive VERBATIM)
add_custom_target(command_documents ALL DEPENDS ${share}/man/man1/dive.1.gz)

install(TARGETS dive RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT runtime)
install(DIRECTORY ${share}/ DESTINATION ${CMAKE_INSTALL_DATADIR} COMPONENT runtime)
install(DIRECTORY missions DESTINATION ${DIVE_DATA} COMPONENT runtime
  PATTERN "*.py" EXCLUDE PATTERN "README.md" EXCLUDE PATTERN templates EXCLUDE)
install(FILES missions/README.md DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME missions.md COMPONENT runtime)
install(FILES doc/on-the-vehicle.md doc/glossary.md DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT runtime)
install(FILES packaging/systemd/dive-run.service packaging/systemd/dive-supervise.service
  DESTINATION lib/systemd/system COMPONENT runtime)
install(FILES packaging/systemd/dive.conf DESTINATION lib/sysusers.d COMPONENT runtime)

# --- development ---

get_property(libraries GLOBAL PROPERTY DIVE_LIBRARIES)
get_property(wrapped GLOBAL PROPERTY DIVE_WRAPPED_LIBRARIES)
list(REMOVE_ITEM libraries dive_cli)
foreach(library IN LISTS libraries wrapped)
  string(REGEX REPLACE "^dive_" "" short ${library})
  set_target_properties(${library} PROPERTIES EXPORT_NAME ${short})
endforeach()
install(TARGETS ${libraries} ${wrapped} EXPORT dive-targets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR}/dive COMPONENT development)
install(EXPORT dive-targets NAMESPACE dive:: DESTINATION ${DIVE_PACKAGE} COMPONENT development)
install(DIRECTORY common planning estimation vehicle behaviors mission
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/dive COMPONENT development
  FILES_MATCHING PATTERN "*.h" PATTERN page EXCLUDE PATTERN messages EXCLUDE PATTERN cli EXCLUDE)
install(FILES cmake/PinnedFunctions.list DESTINATION ${DIVE_PACKAGE} COMPONENT development)
configure_package_config_file(cmake/dive-config.cmake.in ${CMAKE_BINARY_DIR}/dive-config.cmake
  INSTALL_DESTINATION ${DIVE_PACKAGE})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/dive-config-version.cmake COMPATIBILITY ExactVersion)
install(FILES ${CMAKE_BINARY_DIR}/dive-config.cmake ${CMAKE_BINARY_DIR}/dive-config-version.cmake
  DESTINATION ${DIVE_PACKAGE} COMPONENT development)
install(DIRECTORY examples DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT development)

# All that an installation copies.
add_custom_target(installable DEPENDS dive command_documents ${libraries})
