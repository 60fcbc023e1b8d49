# Package files, so that find_package(dlsd) works from the installed tree.
include(CMakePackageConfigHelpers)
set(config_dir ${CMAKE_INSTALL_LIBDIR}/cmake/dlsd)
install(EXPORT dlsdTargets NAMESPACE dlsd:: DESTINATION ${config_dir})
configure_package_config_file(cmake/dlsdConfig.cmake.in ${PROJECT_BINARY_DIR}/dlsdConfig.cmake
                              INSTALL_DESTINATION ${config_dir})
write_basic_package_version_file(${PROJECT_BINARY_DIR}/dlsdConfigVersion.cmake
                                 COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/dlsdConfig.cmake ${PROJECT_BINARY_DIR}/dlsdConfigVersion.cmake
        DESTINATION ${config_dir})
